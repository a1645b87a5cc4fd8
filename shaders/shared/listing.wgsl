// Words of a list's header: the arguments of an indirect dispatch over all entries, 64 per workgroup, and the number of
// entries.
const GROUPS = 0u;
const GROUPS_Y = 1u;
const GROUPS_Z = 2u;
const COUNT = 3u;
// Further words of the pixel list's header. FOUND: pixels found, of which COUNT are listed. LISTED: tiles that may be
// lit. LEFT: shortened lists of thinning that still contained a tile. SHOTS: pictures. STARTS: the first pixel of every
// picture, and the end.
const FOUND = 4u;
const LISTED = 5u;
const LEFT = 6u;
const SHOTS = 7u;
const STARTS = 8u;
// Words from one header to the next.
const HEADER_WORDS = 64u;
