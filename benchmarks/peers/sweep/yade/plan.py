import itertools
import sys

with open("runs.table", "w") as file:
    print("frequency_hz seed", file=file)
    for frequency_hz, seed in itertools.product(range(20, 20 + int(sys.argv[1])), range(1, 6)):
        print(frequency_hz, seed, file=file)
