// In: the tile list, and for every tile whether it is in it. Out: the listed tiles as runs of up to four, one below the
// other: those that stand alone in one list, longer ones in another, so that neighbouring invocations do as much.
// A run's windows share most of their rows. Runs begin anew at every fourth row of tiles.
@group(0) @binding(0) var<uniform> frame: Frame;
@group(0) @binding(1) var<storage, read> listing: array<u32>;
@group(0) @binding(2) var<storage, read> list: array<u32>;
@group(0) @binding(3) var<storage, read> listed: array<u32>;
@group(0) @binding(4) var<storage, read_write> single_listing: Listing;
// (first tile, number of tiles)
@group(0) @binding(5) var<storage, read_write> singles: array<vec2<u32>>;
@group(0) @binding(6) var<storage, read_write> run_listing: Listing;
@group(0) @binding(7) var<storage, read_write> runs: array<vec2<u32>>;

@compute @workgroup_size(64)
fn main(@builtin(global_invocation_id) id: vec3<u32>) {
    for (var inside = u32(id.x < listing[3]); inside > 0u; inside--) {
        let tile = list[id.x];
        let at = tile_index(tile);
        let y = tile_y(tile);
        let place = y % 4u;
        let pitch = frame.tiles_x;
        let above = listed[select(at, at - pitch, place > 0u)];
        for (var begins = u32(place == 0u || above == 0u); begins > 0u; begins--) {
            let room = min(3u - place, frame.tiles_y - 1u - y);
            let second = select(0u, listed[at + select(0u, pitch, room >= 1u)], room >= 1u);
            let third = second * select(0u, listed[at + select(0u, 2u * pitch, room >= 2u)], room >= 2u);
            let fourth = third * select(0u, listed[at + select(0u, 3u * pitch, room >= 3u)], room >= 3u);
            let length = 1u + second + third + fourth;
            for (var alone = u32(length == 1u); alone > 0u; alone--) {
                let slot = atomicAdd(&single_listing.count, 1u);
                singles[slot] = vec2(tile, 1u);
                for (var group = u32(slot % 64u == 0u); group > 0u; group--) {
                    atomicAdd(&single_listing.groups, 1u);
                }
            }
            for (var more = u32(length > 1u); more > 0u; more--) {
                let slot = atomicAdd(&run_listing.count, 1u);
                runs[slot] = vec2(tile, length);
                for (var group = u32(slot % 64u == 0u); group > 0u; group--) {
                    atomicAdd(&run_listing.groups, 1u);
                }
            }
        }
    }
}
