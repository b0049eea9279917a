"""The question and the marking: scenes, results, differences, convergence, tables, pages, gate."""
