"""Creep forces: all laws with one signature, and the creep table.

kalker     coefficients of the linear theory          axes       axes and interpolation of the table
fastsim    simplified theory                          build      nodes of the table, random check
laws       all laws by number: `laws.creep_force`     table      tables on disk: `table.ensure_table`
cases      creep forces of a list of cases
"""
