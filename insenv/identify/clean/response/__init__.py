r"""How an output follows the table: gain and lag, before anything relative to the input is looked for.

    y = g u(t - tau_r) + b_r + noise

A gain of -0.87 is an axis that points the other way with a scale of its own: no small error, and what multiplies the
rate (a skew, a held output, an asymmetry) is a share of what the instrument makes of it, g u. g is one for all runs,
the lag tau_r one for each: clocks are started anew. u is the motion behind the encoder's noise
(`insenv.core.series.trajectory`), shifted exactly. The fit (`fit`) begins at the lag at which y and u correlate most,
whatever that is made of (`forms`). Of a command that jumps the ends of its dwells are asked alone (`found`).

Nothing is taken out by this. Gains near one and lags beside an exact reference stay as they are: the search has effects
for them.
"""
