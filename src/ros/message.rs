//! Messages and services as Rust types, one module per ROS package.
//!
//! Field names, order and types are those of the `.msg` and `.srv` texts in
//! `src/ros/schema/`, which carry the meaning and the unit of each field; a
//! test compares the two, and golden bytes of a real ROS 2 prove the layout.
//! `Default` is the default of ROS: a quaternion starts at w = 1.

use serde::Serialize;
use serde::de::DeserializeOwned;

/// Implements [`Message`] and the marker of `ros2_client` for one type.
macro_rules! message {
    ($($type:ident = $name:literal),+ $(,)?) => {
        $(
            impl crate::ros::message::Message for $type {
                const TYPE_NAME: &'static str = $name;
            }
            impl ros2_client::Message for $type {}
        )+
    };
}

pub mod builtin_interfaces;
pub mod diagnostic_msgs;
pub mod foxglove_msgs;
pub mod geometry_msgs;
pub mod rcl_interfaces;
pub mod rosgraph_msgs;
pub mod salient_stereo_msgs;
pub mod sensor_msgs;
pub mod std_msgs;
pub mod std_srvs;
pub mod stereo_msgs;
pub mod vision_msgs;
pub mod visualization_msgs;

/// A message, or one half of a service.
pub trait Message: Serialize + DeserializeOwned + ros2_client::Message {
    /// The full name, as `sensor_msgs/msg/Image` or
    /// `std_srvs/srv/Trigger_Request`.
    const TYPE_NAME: &'static str;
}

/// Arrays longer than the 32 elements that serde knows by itself.
mod array {
    use std::fmt;

    use serde::de::{Error, SeqAccess, Visitor};
    use serde::ser::SerializeTuple;
    use serde::{Deserializer, Serializer};

    pub fn serialize<S: Serializer, const N: usize>(
        values: &[f64; N],
        serializer: S,
    ) -> Result<S::Ok, S::Error> {
        let mut tuple = serializer.serialize_tuple(N)?;
        for value in values {
            tuple.serialize_element(value)?;
        }
        tuple.end()
    }

    pub fn deserialize<'de, D: Deserializer<'de>, const N: usize>(
        deserializer: D,
    ) -> Result<[f64; N], D::Error> {
        struct Values<const N: usize>;
        impl<'de, const N: usize> Visitor<'de> for Values<N> {
            type Value = [f64; N];

            fn expecting(&self, f: &mut fmt::Formatter) -> fmt::Result {
                write!(f, "{N} numbers")
            }

            fn visit_seq<A: SeqAccess<'de>>(self, mut seq: A) -> Result<[f64; N], A::Error> {
                let mut values = [0.0; N];
                for (i, value) in values.iter_mut().enumerate() {
                    *value =
                        seq.next_element()?.ok_or_else(|| A::Error::invalid_length(i, &self))?;
                }
                Ok(values)
            }
        }
        deserializer.deserialize_tuple(N, Values::<N>)
    }
}
