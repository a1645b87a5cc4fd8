//! In: values. Out: the structures of OPC 40100-1 that carry them, as bytes and back [opc-mv, 12].
//! Frame and unit: those of the values.

use super::ids::{VISION, data};
use opcua::types::{
    BinaryDecodable, BinaryEncodable, ByteString, DateTime, ExpandedMessageInfo, ExpandedNodeId, LocalizedText,
    StaticTypeLoader, TypeLoaderInstance, UAString, Variant, binary_decode_to_enc,
};
use std::sync::OnceLock;

/// A structure of the specification has a node and a node of its binary encoding.
macro_rules! numbered {
    ($name:ident, $node:expr, $encoding:expr) => {
        impl ExpandedMessageInfo for $name {
            fn full_type_id(&self) -> ExpandedNodeId {
                ExpandedNodeId::new_with_namespace(VISION, $encoding as u32)
            }
            fn full_json_type_id(&self) -> ExpandedNodeId {
                ExpandedNodeId::null()
            }
            fn full_xml_type_id(&self) -> ExpandedNodeId {
                ExpandedNodeId::null()
            }
            fn full_data_type_id(&self) -> ExpandedNodeId {
                ExpandedNodeId::new_with_namespace(VISION, $node)
            }
        }
    };
}

/// An identifier with a version and a hash.
macro_rules! identifier {
    ($name:ident, $node:expr, $encoding:expr) => {
        #[derive(Clone, Debug, Default, PartialEq, BinaryEncodable, BinaryDecodable)]
        pub struct $name {
            pub id: UAString,
            #[opcua(optional)]
            pub version: Option<UAString>,
            #[opcua(optional)]
            pub hash: Option<ByteString>,
            #[opcua(optional)]
            pub hash_algorithm: Option<UAString>,
            #[opcua(optional)]
            pub description: Option<LocalizedText>,
        }

        numbered!($name, $node, $encoding);
    };
}

impl RecipeIdExternal {
    pub fn of(id: &str) -> RecipeIdExternal {
        RecipeIdExternal { id: id.into(), ..RecipeIdExternal::default() }
    }
}

impl RecipeIdInternal {
    pub fn of(id: &str) -> RecipeIdInternal {
        RecipeIdInternal { id: id.into(), ..RecipeIdInternal::default() }
    }
}

/// An identifier that may have a description.
macro_rules! described {
    ($name:ident, $node:expr, $encoding:expr) => {
        #[derive(Clone, Debug, Default, PartialEq, BinaryEncodable, BinaryDecodable)]
        pub struct $name {
            pub id: UAString,
            #[opcua(optional)]
            pub description: Option<LocalizedText>,
        }

        numbered!($name, $node, $encoding);
    };
}

/// An identifier alone.
macro_rules! plain {
    ($name:ident, $node:expr, $encoding:expr) => {
        #[derive(Clone, Debug, Default, PartialEq, BinaryEncodable, BinaryDecodable)]
        pub struct $name {
            pub id: UAString,
        }

        numbered!($name, $node, $encoding);
    };
}

identifier!(RecipeIdExternal, data::RECIPE_ID_EXTERNAL, 5002);
identifier!(RecipeIdInternal, data::RECIPE_ID_INTERNAL, 5268);
identifier!(ConfigurationId, data::CONFIGURATION_ID, 5090);
described!(MeasId, data::MEAS_ID, 5006);
described!(PartId, data::PART_ID, 5013);
described!(ProductId, data::PRODUCT_ID, 5224);
plain!(JobId, data::JOB_ID, 5008);
plain!(ResultId, data::RESULT_ID, 5274);

/// Begin and end of a job.
#[derive(Clone, Debug, Default, PartialEq, BinaryEncodable)]
pub struct ProcessingTimes {
    pub start_time: DateTime,
    pub end_time: DateTime,
    #[opcua(optional)]
    pub acquisition_duration: Option<f64>,
    #[opcua(optional)]
    pub processing_duration: Option<f64>,
}
numbered!(ProcessingTimes, data::PROCESSING_TIMES, 5016);

/// A result. Its content is an array that may be missing, and an array may be null: two options.
#[derive(Clone, Debug, Default, PartialEq, BinaryEncodable)]
pub struct ResultData {
    pub result_id: ResultId,
    #[opcua(optional)]
    pub has_transferable_data_on_file: Option<bool>,
    pub is_partial: bool,
    #[opcua(optional)]
    pub is_simulated: Option<bool>,
    pub result_state: i32,
    #[opcua(optional)]
    pub meas_id: Option<MeasId>,
    #[opcua(optional)]
    pub part_id: Option<PartId>,
    #[opcua(optional)]
    pub external_recipe_id: Option<RecipeIdExternal>,
    pub internal_recipe_id: RecipeIdInternal,
    #[opcua(optional)]
    pub product_id: Option<ProductId>,
    #[opcua(optional)]
    pub external_configuration_id: Option<ConfigurationId>,
    pub internal_configuration_id: ConfigurationId,
    pub job_id: JobId,
    pub creation_time: DateTime,
    #[opcua(optional)]
    pub processing_times: Option<ProcessingTimes>,
    #[opcua(optional)]
    pub result_content: Option<Option<Vec<Variant>>>,
}
numbered!(ResultData, data::RESULT, 5018);

/// Reads the structures that clients send.
pub struct Loader;

impl StaticTypeLoader for Loader {
    fn instance() -> &'static TypeLoaderInstance {
        static READS: OnceLock<TypeLoaderInstance> = OnceLock::new();
        READS.get_or_init(|| {
            let mut reads = TypeLoaderInstance::new();
            reads.add_binary_type(data::RECIPE_ID_EXTERNAL, 5002, binary_decode_to_enc::<RecipeIdExternal>);
            reads.add_binary_type(data::RECIPE_ID_INTERNAL, 5268, binary_decode_to_enc::<RecipeIdInternal>);
            reads.add_binary_type(data::CONFIGURATION_ID, 5090, binary_decode_to_enc::<ConfigurationId>);
            reads.add_binary_type(data::MEAS_ID, 5006, binary_decode_to_enc::<MeasId>);
            reads.add_binary_type(data::PART_ID, 5013, binary_decode_to_enc::<PartId>);
            reads.add_binary_type(data::PRODUCT_ID, 5224, binary_decode_to_enc::<ProductId>);
            reads.add_binary_type(data::JOB_ID, 5008, binary_decode_to_enc::<JobId>);
            reads.add_binary_type(data::RESULT_ID, 5274, binary_decode_to_enc::<ResultId>);
            reads
        })
    }

    fn namespace() -> &'static str {
        VISION
    }
}
