//! In: a word that names a source of pictures (a URI). Out: frames with their ids and times, paired with poses, each one
//! accounted for; recordings.
//! Frame and unit: times in ns; poses base_from_flange, mm.
