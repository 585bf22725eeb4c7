import itertools
import sys

import signac

project = signac.init_project()
for frequency_hz, seed in itertools.product(range(20, 20 + int(sys.argv[1])), range(1, 6)):
    project.open_job({"frequency_hz": frequency_hz, "seed": seed}).init()
