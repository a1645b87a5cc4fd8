//! In: a station's folder. Out: the operator's screen, served to browsers.
//! One port; everything it does is a procedure of `station` that the command line has too.
//! Frame and unit: as the procedures; texts show theirs.
