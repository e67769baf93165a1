"""Markdown table of the measured Pareto fronts for reports/accuracy.md."""

from wrcore.run.accuracy import measured_front


def front_markdown(front=None, accuracies=(1e-4, 1e-5, 1e-6, 1e-7)):
    """Return a Markdown table of the fastest measured choice for each accuracy (RMS error of y, m).

    ``front`` is the package's measured front by default. Accuracies that no choice reaches have no row, nor have
    accuracies with the same choice as the next smaller accuracy.
    """
    front = measured_front() if front is None else front
    head = ("scene", "error below", "detection, creep, method, rtol", "error", "of N", "times real time")
    lines = [f"| {' | '.join(head)} |", "|---" * len(head) + "|"]
    for (kind, speed), rows in front.groupby(["kind", "speed_m_per_s"], sort=False):
        last = None
        for accuracy in sorted(accuracies):
            enough = rows[rows["y_rms_m"] <= accuracy]
            if not len(enough):
                continue
            row = enough.loc[enough["real_time_factor"].idxmax()]
            line = (
                f"{row['detection']}, {row['creep']}, {row['method']}, {row['rtol']:g} |"
                f" {1e6 * row['y_rms_m']:.2g} µm | {100 * row['N_rms_relative']:.2g} % |"
                f" {row['real_time_factor']:.3g} |"
            )
            scene = f"| {kind.replace('_', ' ')}, {speed:g} m/s | {1e6 * accuracy:g} µm | "
            if line != last:
                lines.append(scene + line)
            last = line
    return "\n".join(lines)
