"""The independent reference: quadratic tetrahedra on the grooved solid, by gmsh and scikit-fem."""
