"""The real patch: normal and rolling contact of any shape.

strips  windows of Galerkin strips: ``gap`` (surfaces and rigid slip), ``windows``, ``fixed`` (where strips lie),
        ``strips``, ``newton``, ``normal_influence`` (normal problem), ``solve`` (one patch);
        ``panels``, ``rolling``, ``resolvent``, ``library``, ``rolling_influence`` (tangential problem)
grid    a uniform grid, which never fails, as reference and fallback: ``surfaces``, ``grid``, ``grid_pressure``,
        ``edges``, ``grid_traction``, ``fourier``, ``reference``
both    ``result`` (`Patch`: fields and forces), ``model`` (what vehicles' runs need)
"""
