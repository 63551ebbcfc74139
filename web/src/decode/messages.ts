/** To the worker. */
export type ToDecoder =
  | {
      readonly kind: 'chunk';
      readonly frameId: number;
      readonly key: boolean;
      readonly data: Uint8Array;
    }
  | { readonly kind: 'reset' };

/** From the worker. */
export type FromDecoder =
  | { readonly kind: 'picture'; readonly frame: VideoFrame; readonly decodedMs: number }
  | { readonly kind: 'waiting' } // thrown away: needs a key frame first
  | { readonly kind: 'key_frame_needed'; readonly reason: string }
  | { readonly kind: 'unsupported'; readonly reason: string };
