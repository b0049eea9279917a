"""One file per exhibit: joins scene, solvers and comparison into a page."""
