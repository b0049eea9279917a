"""The integration study: Fig. 4 of the paper, extended to stiffness, to any outline and to the tread catalogue.

`cases` states the elements, `runs` measures them, `study` judges and writes the page.
"""
