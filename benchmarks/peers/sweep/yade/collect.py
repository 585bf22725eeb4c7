import csv
import glob
import json

rows = [json.load(open(name)) for name in sorted(glob.glob("results/*.json"))]
with open("summary.tsv", "w") as file:
    table = csv.DictWriter(file, list(rows[0]), delimiter="\t")
    table.writeheader()
    table.writerows(rows)
