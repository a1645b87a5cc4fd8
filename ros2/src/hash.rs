//! In: a definition. Out: its hash as ROS 2 names it: RIHS01, SHA-256 of the type's description as JSON [REP-2011,
//! REP-2016].

use super::definition::{Count, Definition, Field, Kind};
use sha2::{Digest, Sha256};

/// The first word of every hash; 01 is the version of the standard.
const NAME: &str = "RIHS01_";

/// The hash of the type with all that it depends on.
pub fn of(definition: &Definition) -> String {
    let digest = Sha256::digest(description(definition));
    digest.iter().fold(NAME.to_owned(), |text, byte| text + &format!("{byte:02x}"))
}

/// The description, byte for byte as the standard hashes it: a space behind every comma and colon, types in the order
/// of their names, no defaults and no constants.
fn description(definition: &Definition) -> String {
    let others = definition.types.iter().filter(|(name, _)| **name != definition.name);
    let others: Vec<String> = others.map(|(name, fields)| one(name, fields)).collect();
    format!(
        "{{\"type_description\": {}, \"referenced_type_descriptions\": [{}]}}",
        one(&definition.name, &definition.types[&definition.name]),
        others.join(", ")
    )
}

/// Names are words here, so nothing has to be escaped.
fn one(name: &str, fields: &[Field]) -> String {
    // ROS 2 puts a byte into a type without fields.
    let empty = [Field {
        name: "structure_needs_at_least_one_member".into(),
        kind: Kind::Uint8,
        count: Count::One,
        longest: 0,
        nested: String::new(),
    }];
    let fields = if fields.is_empty() { &empty } else { fields };
    let fields: Vec<String> = fields.iter().map(field).collect();
    format!("{{\"type_name\": \"{name}\", \"fields\": [{}]}}", fields.join(", "))
}

fn field(f: &Field) -> String {
    // The standard counts arrays from 48 on, bounded sequences from 96, others from 144.
    let (beyond, capacity) = match f.count {
        Count::One => (0, 0),
        Count::Fixed(n) => (48, n),
        Count::Bounded(n) => (96, n),
        Count::Any => (144, 0),
    };
    format!(
        "{{\"name\": \"{}\", \"type\": {{\"type_id\": {}, \"capacity\": {capacity}, \"string_capacity\": {}, \
         \"nested_type_name\": \"{}\"}}}}",
        f.name,
        f.kind as u32 + beyond,
        f.longest,
        f.nested
    )
}

#[cfg(test)]
mod tests {
    use super::*;

    fn hash(name: &str, text: &str) -> String {
        of(&Definition::read(name, text.as_bytes()).unwrap())
    }

    const HEADER: &str = "builtin_interfaces/Time stamp\nstring frame_id\n";
    const TIME: &str = "===\nMSG: builtin_interfaces/Time\nint32 sec\nuint32 nanosec\n";
    const VECTORS: &str = "===\nMSG: geometry_msgs/Vector3\nfloat64 x\nfloat64 y\nfloat64 z\n\
        ===\nMSG: geometry_msgs/Point\nfloat64 x\nfloat64 y\nfloat64 z\n\
        ===\nMSG: geometry_msgs/Quaternion\nfloat64 x 0\nfloat64 y 0\nfloat64 z 0\nfloat64 w 1\n";

    /// The right sides are those that ROS 2 Jazzy prints (`ros2 topic info --verbose`), as several projects that talk
    /// to it have published them. The definitions of Sheetlight's own messages are compared in tests/ros2.py.
    #[test]
    fn hashes_are_those_of_ros_2() {
        let head = format!("===\nMSG: std_msgs/Header\n{HEADER}{TIME}");
        let same = |name: &str, text: &str, published: &str| {
            assert_eq!(hash(name, text), format!("RIHS01_{published}"), "{name}");
        };
        same("std_msgs/msg/String", "string data", "df668c740482bbd48fb39d76a70dfd4bd59db1288021743503259e948f6b1a18");
        same(
            "builtin_interfaces/msg/Time",
            "int32 sec\nuint32 nanosec\n",
            "b106235e25a4c5ed35098aa0a61a3ee9c9b18d197f398b0e4206cea9acf9c197",
        );
        same(
            "std_msgs/msg/Header",
            &format!("{HEADER}{TIME}"),
            "f49fb3ae2cf070f793645ff749683ac6b06203e41c891e17701b1cb597ce6a01",
        );
        same(
            "sensor_msgs/msg/Image",
            &format!(
                "std_msgs/Header header\nuint32 height\nuint32 width\nstring encoding\nuint8 is_bigendian\n\
                 uint32 step\nuint8[] data\n{head}"
            ),
            "d31d41a9a4c4bc8eae9be757b0beed306564f7526c88ea6a4588fb9582527d47",
        );
        same(
            "geometry_msgs/msg/PoseStamped",
            &format!(
                "std_msgs/Header header\nPose pose\n{head}===\nMSG: geometry_msgs/Pose\n\
                 Point position\nQuaternion orientation\n{VECTORS}"
            ),
            "10f3786d7d40fd2b54367835614bff85d4ad3b5dab62bf8bca0cc232d73b4cd8",
        );
        same(
            "tf2_msgs/msg/TFMessage",
            &format!(
                "geometry_msgs/TransformStamped[] transforms\n===\nMSG: geometry_msgs/TransformStamped\n\
                 std_msgs/Header header\nstring child_frame_id\nTransform transform\n{head}\
                 ===\nMSG: geometry_msgs/Transform\nVector3 translation\nQuaternion rotation\n{VECTORS}"
            ),
            "e369d0f05a23ae52508854b66f6aa0437f3449d652e8cbf22d5abe85d020f087",
        );
        // Arrays of a fixed size.
        same(
            "sensor_msgs/msg/Imu",
            &format!(
                "std_msgs/Header header\ngeometry_msgs/Quaternion orientation\nfloat64[9] orientation_covariance\n\
                 geometry_msgs/Vector3 angular_velocity\nfloat64[9] angular_velocity_covariance\n\
                 geometry_msgs/Vector3 linear_acceleration\nfloat64[9] linear_acceleration_covariance\n{head}{VECTORS}"
            ),
            "7d9a00ff131080897a5ec7e26e315954b8eae3353c3f995c55faf71574000b5b",
        );
    }
}
