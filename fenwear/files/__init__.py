"""Files of other programs: meshes, shapes from CAD, measured tables and height maps, each read into arrays with names.

Readers are functions from a path to a data class. They know nothing of bodies or solvers.
"""
