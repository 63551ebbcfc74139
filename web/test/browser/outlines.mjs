// Beside these a click means what is behind, 10 to 15 % further: whether it is hit is luck, not the page's work.
// `saccade-eval sim --scenario desk` counts them (claims: on_outlines).
export const AT_OUTLINES = ['shelf edge', 'keyboard corner'];
