//! In: a kind of message. Out: its name in ROS 2, and its definition with those that it depends on, as an MCAP file
//! contains them.
//! Frame and unit: stated where the messages are written.

/// Kinds of messages that are written.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub enum Kind {
    /// Points with their fields.
    PointCloud,
    /// Transforms between frames.
    Transforms,
    /// A picture.
    Image,
    /// The camera of a picture.
    CameraInfo,
    /// A pose with frame and time.
    Pose,
    /// Figures with a level.
    Diagnostics,
}

/// A definition: package/Name, fields.
type Definition = (&'static str, &'static str);

const TIME: Definition = ("builtin_interfaces/Time", "int32 sec\nuint32 nanosec\n");
const HEADER: Definition = ("std_msgs/Header", "builtin_interfaces/Time stamp\nstring frame_id\n");
const POINT: Definition = ("geometry_msgs/Point", "float64 x\nfloat64 y\nfloat64 z\n");
const VECTOR: Definition = ("geometry_msgs/Vector3", "float64 x\nfloat64 y\nfloat64 z\n");
const QUATERNION: Definition = ("geometry_msgs/Quaternion", "float64 x 0\nfloat64 y 0\nfloat64 z 0\nfloat64 w 1\n");
const POSE: Definition = ("geometry_msgs/Pose", "geometry_msgs/Point position\ngeometry_msgs/Quaternion orientation\n");
const TRANSFORM: Definition =
    ("geometry_msgs/Transform", "geometry_msgs/Vector3 translation\ngeometry_msgs/Quaternion rotation\n");
const TRANSFORM_STAMPED: Definition = (
    "geometry_msgs/TransformStamped",
    "std_msgs/Header header\nstring child_frame_id\ngeometry_msgs/Transform transform\n",
);
const POINT_FIELD: Definition = (
    "sensor_msgs/PointField",
    "uint8 INT8=1\nuint8 UINT8=2\nuint8 INT16=3\nuint8 UINT16=4\nuint8 INT32=5\nuint8 UINT32=6\nuint8 FLOAT32=7\n\
     uint8 FLOAT64=8\nstring name\nuint32 offset\nuint8 datatype\nuint32 count\n",
);
const REGION: Definition = (
    "sensor_msgs/RegionOfInterest",
    "uint32 x_offset\nuint32 y_offset\nuint32 height\nuint32 width\nbool do_rectify\n",
);
const KEY_VALUE: Definition = ("diagnostic_msgs/KeyValue", "string key\nstring value\n");
const STATUS: Definition = (
    "diagnostic_msgs/DiagnosticStatus",
    "byte OK=0\nbyte WARN=1\nbyte ERROR=2\nbyte STALE=3\nbyte level\nstring name\nstring message\nstring hardware_id\n\
     diagnostic_msgs/KeyValue[] values\n",
);

impl Kind {
    /// package/msg/Name, the name of its schema.
    pub fn name(self) -> &'static str {
        match self {
            Kind::PointCloud => "sensor_msgs/msg/PointCloud2",
            Kind::Transforms => "tf2_msgs/msg/TFMessage",
            Kind::Image => "sensor_msgs/msg/Image",
            Kind::CameraInfo => "sensor_msgs/msg/CameraInfo",
            Kind::Pose => "geometry_msgs/msg/PoseStamped",
            Kind::Diagnostics => "diagnostic_msgs/msg/DiagnosticArray",
        }
    }

    fn fields(self) -> &'static str {
        match self {
            Kind::PointCloud => {
                "std_msgs/Header header\nuint32 height\nuint32 width\nsensor_msgs/PointField[] fields\n\
                 bool is_bigendian\nuint32 point_step\nuint32 row_step\nuint8[] data\nbool is_dense\n"
            }
            Kind::Transforms => "geometry_msgs/TransformStamped[] transforms\n",
            Kind::Image => {
                "std_msgs/Header header\nuint32 height\nuint32 width\nstring encoding\nuint8 is_bigendian\n\
                 uint32 step\nuint8[] data\n"
            }
            Kind::CameraInfo => {
                "std_msgs/Header header\nuint32 height\nuint32 width\nstring distortion_model\nfloat64[] d\n\
                 float64[9] k\nfloat64[9] r\nfloat64[12] p\nuint32 binning_x\nuint32 binning_y\n\
                 sensor_msgs/RegionOfInterest roi\n"
            }
            Kind::Pose => "std_msgs/Header header\ngeometry_msgs/Pose pose\n",
            Kind::Diagnostics => "std_msgs/Header header\ndiagnostic_msgs/DiagnosticStatus[] status\n",
        }
    }

    fn rests_on(self) -> &'static [Definition] {
        match self {
            Kind::PointCloud => &[HEADER, TIME, POINT_FIELD],
            Kind::Transforms => &[TRANSFORM_STAMPED, HEADER, TIME, TRANSFORM, VECTOR, QUATERNION],
            Kind::Image => &[HEADER, TIME],
            Kind::CameraInfo => &[HEADER, TIME, REGION],
            Kind::Pose => &[HEADER, TIME, POSE, POINT, QUATERNION],
            Kind::Diagnostics => &[HEADER, TIME, STATUS, KEY_VALUE],
        }
    }

    /// Its own fields, then every definition that it depends on, each after a line with its name.
    pub fn definition(self) -> String {
        let mut text = self.fields().to_owned();
        for (name, fields) in self.rests_on() {
            text += &format!("{}\nMSG: {name}\n{fields}", "=".repeat(80));
        }
        text
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Every type that a definition names has a definition below it, exactly once.
    #[test]
    fn a_definition_is_whole() {
        let all = [Kind::PointCloud, Kind::Transforms, Kind::Image, Kind::CameraInfo, Kind::Pose, Kind::Diagnostics];
        for kind in all {
            let text = kind.definition();
            let used = text.lines().filter_map(|l| l.split_once(' ')).filter(|(word, _)| *word != "MSG:");
            let mut used: Vec<&str> =
                used.map(|(word, _)| word.trim_end_matches("[]")).filter(|w| w.contains('/')).collect();
            let mut there: Vec<&str> = text.lines().filter_map(|l| l.strip_prefix("MSG: ")).collect();
            used.sort_unstable();
            used.dedup();
            there.sort_unstable();
            assert_eq!(used, there, "{}", kind.name());
        }
    }
}
