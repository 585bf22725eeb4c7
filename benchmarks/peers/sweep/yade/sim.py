import os
import subprocess

readParamsFromTable(frequency_hz=50, seed=1)
from yade.params.table import *

os.makedirs("results", exist_ok=True)
out = f"results/{frequency_hz:g}_{seed}.json"
subprocess.run(["python3", "one_run.py", str(frequency_hz), str(seed), out], check=True)
