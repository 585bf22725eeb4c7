import itertools
import sys

import pandas as pd

runs = itertools.product(range(20, 20 + int(sys.argv[1])), range(1, 6))
pd.DataFrame(runs, columns=["frequency_hz", "seed"]).to_csv("runs.tsv", sep="\t", index=False)
