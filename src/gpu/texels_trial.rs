//! In: a device. Out: whether its buffers can be read as texels, from one trial with each kind of texel. Frame and
//! unit: words.

use super::description::{Access, Binding, Field, Stage};
use super::texels::{ROW_LOG2, Texel};
use super::{Device, Recording, Replay};
use crate::fault::Result;

/// Whether a buffer can be read as texels of every kind, and a dispatch reads what the dispatch before it wrote.
pub(super) fn trial(device: &Device) -> Result<bool> {
    let mut device = device.clone();
    device.reads_texels = true;
    let Ok(words) = device.storage("texels trial", 16) else { return Ok(false) };
    if Texel::ALL.iter().any(|&t| device.texels(&words, t).is_none()) {
        return Ok(false);
    }
    written_and_read(&device)
}

/// Writes a buffer, reads it as every kind of element and compares.
fn written_and_read(device: &Device) -> Result<bool> {
    const WORDS: u32 = 3 << (ROW_LOG2 + 2); // three rows of the largest texels
    const UNIFORM: (&str, &[Field], usize) = ("", &[], 0);
    const WRITE: Stage = Stage {
        name: "texels write",
        wgsl: "@group(0) @binding(0) var<storage, read_write> words: array<u32>;
@compute @workgroup_size(64)
fn main(@builtin(global_invocation_id) id: vec3<u32>) {
    words[id.x] = id.x * 2654435761u;
}",
        shared: &[],
        workgroup: [64, 1, 1],
        bindings: &[Binding { name: "words", access: Access::ReadWrite }],
        uniform: UNIFORM,
        overrides: &[],
    };
    const READ: Stage = Stage {
        name: "texels read",
        wgsl: "@group(0) @binding(0) var<storage, read> one: array<u32>;
@group(0) @binding(1) var<storage, read> two: array<vec2<u32>>;
@group(0) @binding(2) var<storage, read> four: array<vec4<u32>>;
@group(0) @binding(3) var<storage, read_write> seen: array<vec4<u32>>;
@compute @workgroup_size(64)
fn main(@builtin(global_invocation_id) id: vec3<u32>) {
    let i = id.x;
    seen[i] = vec4(one[i], two[i / 2u][i & 1u], four[i / 4u][i & 3u], 0u);
}",
        shared: &[],
        workgroup: [64, 1, 1],
        bindings: &[
            Binding { name: "one", access: Access::Texels },
            Binding { name: "two", access: Access::Texels },
            Binding { name: "four", access: Access::Texels },
            Binding { name: "seen", access: Access::ReadWrite },
        ],
        uniform: UNIFORM,
        overrides: &[],
    };
    let words = device.storage("texels trial", 4 * u64::from(WORDS))?;
    let seen = device.storage("texels seen", 16 * u64::from(WORDS))?;
    let mut work = Recording::default();
    let groups = [WORDS / 64, 1, 1];
    work.dispatch(device, &WRITE.pipeline(device, &[])?, &[&words], groups);
    work.dispatch(device, &READ.pipeline(device, &[])?, &[&words, &words, &words, &seen], groups);
    Replay::new(device, false)?.run(&[&work])?;
    let seen: Vec<[u32; 4]> = bytemuck::pod_collect_to_vec(&device.read(&seen)?);
    Ok((0u32..).zip(seen).all(|(i, v)| v[..3] == [i.wrapping_mul(2654435761); 3]))
}

#[cfg(test)]
mod tests {
    use super::*;

    /// An array that is too large for an image is read as a buffer, as on every other adapter.
    #[test]
    fn a_stage_runs_without_texels_where_no_image_can_be_had() {
        let Some(mut device) = Device::with_texels_for_tests() else { return };
        assert!(trial(&device).unwrap() && written_and_read(&device).unwrap());
        device.image_rows = 1;
        assert!(!trial(&device).unwrap(), "there are no images to try");
        assert!(written_and_read(&device).unwrap());
    }
}
