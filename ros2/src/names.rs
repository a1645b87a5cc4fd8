//! In: domain, namespace, topic, type and hash. Out: the key expressions and liveliness tokens by which rmw_zenoh
//! finds them.

use super::definition::{LONGEST, is_word};

/// Name of the node.
pub const NODE: &str = "sheetlight";

/// What a node has.
#[derive(Clone, Copy, Debug)]
pub enum Entity {
    Publisher,
    Service,
}

/// Where this program stands in the graph of ROS 2.
#[derive(Clone, Debug)]
pub struct Place {
    pub domain: u32,
    /// Namespace with a leading `/`. `/` means that there is no namespace.
    pub namespace: String,
    /// The identifier of the session, hexadecimal.
    pub session: String,
}

/// Whether a name is one of ROS 2: words with `/` before each.
pub fn is_name(name: &str) -> bool {
    let word = |w: &str| {
        is_word(w) || w.strip_prefix('_').is_some_and(|w| w.chars().all(|c| c.is_ascii_alphanumeric() || c == '_'))
    };
    name.len() <= LONGEST && name.strip_prefix('/').is_some_and(|rest| rest.split('/').all(word))
}

/// The type's name in DDS: `package::msg::dds_::Name_`.
fn dds(kind: &str) -> String {
    let (before, name) = kind.rsplit_once('/').unwrap_or(("", kind));
    format!("{}::dds_::{name}_", before.replace('/', "::"))
}

/// Slashes are `%` in a token.
fn mangled(name: &str) -> String {
    name.replace('/', "%")
}

impl Place {
    /// The topic below the namespace.
    pub fn topic(&self, topic: &str) -> String {
        format!("{}{topic}", self.namespace.trim_end_matches('/'))
    }

    /// The key on which the messages of a topic travel. `topic` is its whole name.
    pub fn key(&self, topic: &str, kind: &str, hash: &str) -> String {
        format!("{}/{}/{}/{hash}", self.domain, topic.trim_start_matches('/'), dds(kind))
    }

    /// The node's token.
    pub fn node(&self) -> String {
        self.token(0, "NN")
    }

    /// The token of a publisher or a service. `id` is another for each, and not 0: that is the node's.
    pub fn entity(&self, id: u32, what: Entity, name: &str, kind: &str, hash: &str, qos: &str) -> String {
        let what = match what {
            Entity::Publisher => "MP",
            Entity::Service => "SS",
        };
        format!("{}/{}/{}/{hash}/{qos}", self.token(id, what), mangled(name), mangled(&dds(kind)))
    }

    /// Domain, session, node 0, entity, kind of entity, enclave, namespace, node.
    fn token(&self, id: u32, what: &str) -> String {
        let Place { domain, session, namespace } = self;
        format!("@ros2_lv/{domain}/{session}/0/{id}/{what}/%/{}/{NODE}", mangled(namespace))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn place(namespace: &str) -> Place {
        Place { domain: 2, namespace: namespace.into(), session: "8b20917502ee955ac4476e0266340d5c".into() }
    }

    /// As in rmw_zenoh's design document, but for the names of the nodes.
    #[test]
    fn tokens_have_the_form_of_rmw_zenoh() {
        let hash = "RIHS01_df668c740482bbd48fb39d76a70dfd4bd59db1288021743503259e948f6b1a18";
        let place = place("/");
        assert_eq!(place.node(), "@ros2_lv/2/8b20917502ee955ac4476e0266340d5c/0/0/NN/%/%/sheetlight");
        assert_eq!(
            place.entity(10, Entity::Publisher, "/chatter", "std_msgs/msg/String", hash, "::,7:,:,:,,"),
            format!(
                "@ros2_lv/2/8b20917502ee955ac4476e0266340d5c/0/10/MP/%/%/sheetlight/%chatter/\
                 std_msgs::msg::dds_::String_/{hash}/::,7:,:,:,,"
            )
        );
        assert_eq!(
            place.entity(11, Entity::Service, "/a/add", "example_interfaces/srv/AddTwoInts", hash, "::,10:,:,:,,"),
            format!(
                "@ros2_lv/2/8b20917502ee955ac4476e0266340d5c/0/11/SS/%/%/sheetlight/%a%add/\
                 example_interfaces::srv::dds_::AddTwoInts_/{hash}/::,10:,:,:,,"
            )
        );
        assert_eq!(
            place.key("/chatter", "std_msgs/msg/String", hash),
            format!("2/chatter/std_msgs::msg::dds_::String_/{hash}")
        );
    }

    #[test]
    fn a_namespace_is_before_every_topic() {
        let place = place("/cell3/left");
        assert_eq!(place.topic("/sheetlight/cloud"), "/cell3/left/sheetlight/cloud");
        assert!(place.node().ends_with("/NN/%/%cell3%left/sheetlight"));
        assert_eq!(self::place("/").topic("/tf"), "/tf");
    }

    #[test]
    fn names_of_ros_2_are_known() {
        for good in ["/a", "/a/b_1", "/_hidden", "/tf_static"] {
            assert!(is_name(good), "{good}");
        }
        assert!(is_name(&format!("/{}", "a".repeat(254))) && !is_name(&format!("/{}", "a".repeat(255))));
        for bad in ["", "/", "a", "/a/", "//a", "/1a", "/a b", "/a*", "/ü", "/a/$b", "/a%b"] {
            assert!(!is_name(bad), "{bad}");
        }
    }
}
