"""Rounds of runs that close in on the optimum of a sweep."""
