//! In: the group and the node that a person names for Sparkplug. Out: their topics.
//! Frame and unit: none.

use sheetlight::fault::{Fault, Result};
use sheetlight::rig::hash_text;

/// First level of all topics of Sparkplug B.
const NAMESPACE: &str = "spBv1.0";
/// Second level of the topics of host applications; a group of this name would be mistaken for one.
const HOSTS: &str = "STATE";
/// Most bytes of a name: topics of MQTT have 65,535 at most.
const LONGEST: usize = 1000;

/// The identity of the station among the nodes of a plant.
#[derive(Clone, Debug, PartialEq)]
pub struct Names {
    group: String,
    node: String,
}

impl Names {
    /// `text`: `GROUP/NODE`.
    ///
    /// # Errors
    /// Other than two names; one that no level of a topic can have.
    pub fn new(text: &str) -> Result<Names> {
        let refused = |why: &str| {
            Fault::usage(format!("'{text}' names no group and node of Sparkplug: {why}"))
                .next("name both with --mqtt-sparkplug, such as plant/cell3")
        };
        let (group, node) = text.split_once('/').ok_or_else(|| refused("there is no / between two names"))?;
        for name in [group, node] {
            if name.is_empty() || name.len() > LONGEST {
                return Err(refused(&format!("a name has {} bytes, limits 1 and {LONGEST}", name.len())));
            }
            if name.contains(['+', '#', '/']) || name.chars().any(char::is_control) {
                return Err(refused("a name has +, #, / or a control character")
                    .cause("brokers keep these characters for levels and subscriptions"));
            }
        }
        if group == HOSTS {
            return Err(refused("STATE is the group of host applications"));
        }
        Ok(Names { group: group.to_owned(), node: node.to_owned() })
    }

    /// The topic of a kind of message, such as `NDATA`.
    pub fn topic(&self, kind: &str) -> String {
        format!("{NAMESPACE}/{}/{kind}/{}", self.group, self.node)
    }

    /// Name of the connection: the same after each start. So a broker ends the former connection of a station, and
    /// publishes its death, before it takes the new one. At most 23 characters, which every broker takes.
    pub fn client(&self) -> String {
        format!("sheetlight-{}", &hash_text(self.topic("").as_bytes())[..12])
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn names_become_topics_or_are_refused() {
        let names = Names::new("Ulm plant/cell 3").unwrap();
        assert_eq!(names.topic("NBIRTH"), "spBv1.0/Ulm plant/NBIRTH/cell 3");
        let long = format!("a/{}", "b".repeat(LONGEST + 1));
        for wrong in ["", "a", "a/", "/b", "a/b/c", "a/+", "#/b", "a/b\n", "STATE/b", &long] {
            let fault = Names::new(wrong).unwrap_err();
            assert!(fault.next.contains("--mqtt-sparkplug"), "{wrong:?}: {fault:?}");
        }
    }

    #[test]
    fn a_connection_has_the_same_name_after_each_start() {
        let [one, same, other] = ["a/b", "a/b", "a/c"].map(|text| Names::new(text).unwrap().client());
        assert!(one == same && one != other && one.len() == 23, "{one} {other}");
    }
}
