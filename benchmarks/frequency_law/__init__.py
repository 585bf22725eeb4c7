"""What the frequency that fills a tube best goes with, from committed studies."""
