"""What the house costs and how exact it is, theme by theme: ``python -m benchmarks.THEME``.

A theme's folder holds what it measures, the template of its page and the numbers of the last
committed measurement, ``results.json``. Themes know the frame and the package, not each other.
"""
