const SPS = 7;

/**
 * The codec string for WebCodecs, from the sequence parameter set in an Annex B access unit, e.g.
 * "avc1.42c01e" for constrained baseline at level 3. Undefined if there is none.
 */
export function codecOf(accessUnit: Uint8Array): string | undefined {
  for (let i = 0; i + 6 < accessUnit.length; ++i) {
    if (accessUnit[i] !== 0 || accessUnit[i + 1] !== 0 || accessUnit[i + 2] !== 1) continue;
    if (((accessUnit[i + 3] ?? 0) & 0x1f) !== SPS) continue;
    const hex = [...accessUnit.subarray(i + 4, i + 7)]
      .map((byte) => byte.toString(16).padStart(2, '0'))
      .join('');
    return `avc1.${hex}`;
  }
  return undefined;
}
