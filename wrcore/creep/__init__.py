"""The tangential (creep) force: every law behind one signature.

kalker     coefficients of the linear theory          operator   panels and influence matrix of one patch
halfspace  exact steady rolling                       axes       axes of the table and its look-up
fastsim    simplified theory                          build      nodes of the table, random check
laws       all laws by number: `laws.creep_force`     table      tables on disk: `table.ensure_table`
cases      creep forces of a list of cases
"""
