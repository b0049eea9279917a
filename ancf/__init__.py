"""ANCF plates with grooves by subdomain integration (He, Patel, Shabana).

NumPy and SciPy, numba for rubber alone; run.py, unpack.py and words.py read the scene.

Index letters of array shapes, used in every docstring and einsum of this package:

    e  element                 q  integration point
    v  nodal vector            i, j, k, n  shape function = nodal vector of one element
    a, b, c  space component   p, r, s, t  reference direction
    m  pair of shape functions (i <= k)
    u  unknown = free component of a nodal vector

A nodal vector is what one shape function multiplies: a position r (m) or a gradient r_x, r_y, r_z.
An underscore suffix is a derivative. Reference coordinates (x, y, z): x and y are the parameters of
the mid-surface, z (m) is measured along its normal.
"""
