"""Plate drop (section 7.1 of the paper): a grooved plate falls on the ground, by contact points and by area."""
