// The block of the stages lines and peak: pictures, stripe, noise, limits of a single peak. The fields are explained at
// the struct of the same name in src/stages/peak/frame.rs.
struct PeakFrame {
    width: i32,
    height: i32,
    pitch: u32,
    shot_words: u32,
    s0: f32,
    full_scale: f32,
    read2: f32,
    gain: f32,
    speckle2: f32,
    belief: f32,
    along_factor: f32,
    radius: f32,
    lattice_u: i32,
    lattice_v: i32,
    stride: i32,
    steps: u32,
    faintest: f32,
    narrowest: f32,
    widest: f32,
    uncertain: f32,
    upright: f32,
    across_u: f32,
    across_v: f32,
    lines: u32,
    columns: u32,
    entries: u32,
    line_px: u32,
    fours: i32,
    half_across: f32,
    rows: i32,
    turn_2: f32,
    turn_4: f32,
    turn_6: f32,
    turn_8: f32,
    square_4: f32,
    square_8: f32,
    flat: f32,
    ragged: f32,
    restless: f32,
}

// One peak, 12 words.
struct Peak {
    u: f32,
    v: f32,
    normal_u: f32,
    normal_v: f32,
    amplitude: f32,
    background: f32,
    width_px: f32,
    sigma_px: f32,
    snr: f32,
    flags: u32,
    pixel: u32,
    shot: u32,
}

// Flags of a peak: the lowest byte is the reason for rejection, 0 if it was not rejected; SATURATED if one of its
// pixels is clipped.
const REASON = 255u;
const FAINT = 2u;
const NARROW = 3u;
const WIDE = 4u;
const UNCERTAIN = 5u;
const STEEP = 6u;
const ECHO = 7u;
const UNSUPPORTED = 8u;
const NO_POINT = 9u;
const SATURATED = 256u;
