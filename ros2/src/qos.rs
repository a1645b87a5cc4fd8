//! In: the quality of service that a recording offers for a topic. Out: the one that is served, and its words in
//! rmw_zenoh's tokens.

/// What subscribers are offered.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Qos {
    pub reliable: bool,
    /// Whether later subscribers get the last messages (durability transient local).
    pub kept: bool,
    /// Number of messages that are kept.
    pub depth: usize,
}

/// Depth that rmw_zenoh uses if a profile states none. Tokens do not contain it.
const DEPTH: usize = 42;
/// Most messages that are kept for later subscribers.
const MOST: usize = 100;

impl Qos {
    /// Reads `offered_qos_profiles` of a channel: YAML with the numbers of ROS 2's middleware, or with its words. Of
    /// several profiles the strongest counts. Without any, messages are reliable and not kept.
    pub fn read(profiles: &str) -> Qos {
        let mut seen = Qos { reliable: false, kept: false, depth: 0 };
        let mut told = false;
        for line in profiles.lines() {
            let Some((key, value)) = line.trim_start_matches([' ', '-']).split_once(':') else { continue };
            match (key, value.trim()) {
                ("reliability", value) => {
                    told = true;
                    seen.reliable |= !matches!(value, "2" | "best_effort");
                }
                ("durability", "1" | "transient_local") => seen.kept = true,
                ("depth", value) => seen.depth = seen.depth.max(value.parse().unwrap_or(0)),
                _ => {}
            }
        }
        seen.reliable |= !told;
        let depth = if seen.depth == 0 { DEPTH } else { seen.depth };
        Qos { depth: if seen.kept { depth.min(MOST) } else { depth }, ..seen }
    }

    /// reliability:durability:history,depth:deadline:lifespan:liveliness; what is rmw_zenoh's default is empty.
    pub fn words(self) -> String {
        let reliability = if self.reliable { "" } else { "2" };
        let durability = if self.kept { "1" } else { "" };
        let depth = if self.depth == DEPTH { String::new() } else { self.depth.to_string() };
        format!("{reliability}:{durability}:,{depth}:,:,:,,")
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn profiles_are_read_in_both_forms() {
        let ours = "- history: 1\n  depth: 1\n  reliability: 1\n  durability: 1\n  deadline: {sec: 0, nsec: 0}\n";
        assert_eq!(Qos::read(ours), Qos { reliable: true, kept: true, depth: 1 });
        let words = "- history: keep_last\n  depth: 5\n  reliability: best_effort\n  durability: volatile\n";
        assert_eq!(Qos::read(words), Qos { reliable: false, kept: false, depth: 5 });
        let both = format!("{words}{ours}");
        assert_eq!(Qos::read(&both), Qos { reliable: true, kept: true, depth: 5 });
        assert_eq!(Qos::read(""), Qos { reliable: true, kept: false, depth: 42 });
        assert_eq!(Qos::read("durability: 1\ndepth: 100000").depth, 100);
    }

    /// The first two are of rmw_zenoh's design document.
    #[test]
    fn the_words_are_those_of_rmw_zenoh() {
        assert_eq!(Qos { reliable: true, kept: false, depth: 7 }.words(), "::,7:,:,:,,");
        assert_eq!(Qos { reliable: true, kept: false, depth: 10 }.words(), "::,10:,:,:,,");
        assert_eq!(Qos { reliable: true, kept: true, depth: 1 }.words(), ":1:,1:,:,:,,");
        assert_eq!(Qos { reliable: false, kept: false, depth: 42 }.words(), "2::,:,:,:,,");
    }
}
