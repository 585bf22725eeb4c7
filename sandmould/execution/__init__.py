"""How a study is computed: jobs, processes, a cluster, the screen, packs, what ended and how."""
