"""The job that every tool is given: ``python one_run.py FREQUENCY SEED OUT``.

It computes nothing of worth, notes that it was started, and fails at the frequency in ``FAIL_HZ``.
"""

import json
import math
import os
import sys

frequency_hz, seed, out = float(sys.argv[1]), int(sys.argv[2]), sys.argv[3]
with open(os.environ["STARTED"], "a", encoding="utf-8") as file:
    file.write(f"{frequency_hz:g} {seed}\n")
if os.environ.get("FAIL_HZ") == f"{frequency_hz:g}":
    sys.exit("this run fails")
fill = 0.5 * math.exp(-((math.log(frequency_hz / 65)) ** 2)) + 1e-3 * seed
partial = f"{out}.partial"
with open(partial, "w", encoding="utf-8") as file:
    json.dump({"frequency_hz": frequency_hz, "seed": seed, "fill": fill}, file)
os.replace(partial, out)
