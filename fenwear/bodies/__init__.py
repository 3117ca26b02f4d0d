"""One body: its mesh, its elasticity, and its condensation onto the contact surface."""
