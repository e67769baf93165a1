"""Compute contact points, contact angle, rolling radius difference and conicity of the study's wheel-rail pairs."""

import sys

import numpy as np

from study.contact import tables as analysis_contact
from wrcore.analysis.contact import rigid
from wrcore.analysis.legible import save_figure
from wrcore.analysis.pictures import plot_contact
from wrcore.analysis.pictures.plot_contact import fig_contact_location
from wrcore.contact.rigid.first_touch import first_touch

sys.stdout = sys.stderr = open(snakemake.log[0], "w", buffering=1)
params, output = snakemake.params, snakemake.output
shifts, amplitudes = (np.linspace(**part) for part in (params.shifts, params.amplitudes))
pairs = {label: analysis_contact.study_pair(settings) for label, settings in params.pairs.items()}
first = next(iter(pairs.values()))
touch = rigid.touch_table(pairs, shifts)
conicity = rigid.conicity_table(pairs, amplitudes)
yawed = rigid.location_with_yaw(first.left.geometry, shifts[shifts >= 0], params.yaws)
for table, path in ((touch, output.touch), (conicity, output.conicity), (yawed, output.yaw)):
    table.to_csv(path, index=False)
by_pair = dict(iter(touch.groupby("pair", sort=False)))
figures = {
    output.location: fig_contact_location(first, first_touch(first, 1e-3 * np.arange(-6, 7))),
    output.radius: plot_contact.fig_rolling_radius_difference(by_pair),
    output.angle: plot_contact.fig_contact_angle(by_pair),
    output.conicity_figure: plot_contact.fig_conicity_of_pairs(conicity),
    output.yaw_figure: plot_contact.fig_location_with_yaw(yawed),
}
for path, figure in figures.items():
    save_figure(figure, path, path.replace(".png", ".svg"))
