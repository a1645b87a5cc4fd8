// In: peaks of some shots with their points, and the points of the neighbouring shots in order along the laser line.
// Out: each peak's flags; peaks that were kept but have too few neighbours there get the reason. Whole numbers, so that
// every machine counts the same neighbours. Twin and reasons: src/stages/support/stage.rs. Frame and unit: base frame,
// 2^-14 mm; grey levels; px.
struct SupportFrame {
    peaks: u32,
    sure: f32,
    right_low: f32,
    right_high: f32,
    haze: f32,
    reserved_0: u32,
    reserved_1: u32,
    reserved_2: u32,
}

// The numbers for a shot's peaks, and where the points of its two neighbouring shots are in the list of sites.
struct Neighbourhood {
    first: array<u32, 2>,
    end: array<u32, 2>,
    reach: array<i32, 2>,
    drop: array<u32, 2>,
    clean: u32,
    doubtful: u32,
    hazy: u32,
    usual: f32,
}

@group(0) @binding(0) var<uniform> frame: SupportFrame;
@group(0) @binding(1) var<storage, read> shots: array<Neighbourhood>;
// x, y, z and the position along the line.
@group(0) @binding(2) var<storage, read> sites: array<vec4<i32>>;
@group(0) @binding(3) var<storage, read> places: array<vec4<i32>>;
@group(0) @binding(4) var<storage, read> peaks: array<Peak>;
@group(0) @binding(5) var<storage, read_write> flags: array<u32>;

const FAR = 32768;

@compute @workgroup_size(64)
fn main(@builtin(global_invocation_id) id: vec3<u32>) {
    if id.x < frame.peaks {
        let k = peaks[id.x];
        let p = places[id.x];
        let shot = k.shot;
        var found = 0u;
        for (var side = 0u; side < 2u; side++) {
            let reach = shots[shot].reach[side];
            let drop = shots[shot].drop[side];
            let end = shots[shot].end[side];
            // Binary search for the first site along the line within reach.
            var i = shots[shot].first[side];
            for (var left = end - i; left > 0u;) {
                let half = left / 2u;
                let before = sites[i + half].w < p.w - reach;
                i = select(i, i + half + 1u, before);
                left = select(half, left - half - 1u, before);
            }
            let r = u32(reach >> drop);
            for (; i < end; i++) {
                let s = sites[i];
                if s.w > p.w + reach {
                    break;
                }
                let d = (s.xyz - p.xyz) >> vec3(drop);
                let near = all(abs(d) < vec3(FAR));
                let q = vec3<u32>(select(vec3(FAR), abs(d), near));
                found += u32(near && q.x * q.x + q.y * q.y + q.z * q.z <= r * r);
            }
        }
        let right = k.sigma_px <= frame.sure && k.width_px >= frame.right_low && k.width_px <= frame.right_high;
        let hazy = k.background - shots[shot].usual > frame.haze * k.amplitude;
        let need = select(select(shots[shot].doubtful, shots[shot].clean, right), shots[shot].hazy, hazy);
        let refused = (k.flags & REASON) == 0u && found < need;
        flags[id.x] = select(k.flags, k.flags | UNSUPPORTED, refused);
    }
}
