"""Pages and files made from the code: keys, schema, measures, files; templates of studies."""
