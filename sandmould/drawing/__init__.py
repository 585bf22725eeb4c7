"""What reports show: charts, figures, films, views of scenes."""
