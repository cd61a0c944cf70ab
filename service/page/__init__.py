"""The web page: one HTML file, its style and scripts, Plotly's JavaScript from the installed package; nothing else."""
