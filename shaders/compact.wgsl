// In: every listed tile and the sub-iteration in which it last changed. Out: a new list of the tiles whose
// neighbourhood still changes. One sub-iteration reaches one pixel, so the list with its neighbours stays complete for
// the next 8 (a tile's height). With an empty list the dispatches that use it do nothing.
@group(0) @binding(0) var<uniform> frame: Frame;
@group(0) @binding(1) var<storage, read> all: array<u32>;
@group(0) @binding(2) var<storage, read> list: array<u32>;
@group(0) @binding(3) var<storage, read> stamps: array<u32>;
@group(0) @binding(4) var<storage, read_write> listing: Listing;
@group(0) @binding(5) var<storage, read_write> active_list: array<u32>;

@compute @workgroup_size(64)
fn main(@builtin(global_invocation_id) id: vec3<u32>) {
    if id.x < all[COUNT] {
        let tile = list[id.x];
        if latest(tile) > frame.step {
            let at = atomicAdd(&listing.count, 1u);
            active_list[at] = tile;
            if at % 64u == 0u {
                atomicAdd(&listing.groups, 1u);
            }
        }
    }
}
