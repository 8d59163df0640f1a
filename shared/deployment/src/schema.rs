//! The JSON schema of deployment files, for editors and other programs.

use schemars::generate::SchemaSettings;
use serde_json::Value;

use crate::Deployment;

/// The JSON schema (draft 2020-12) of a deployment file, made from the structs that read it.
pub fn schema() -> Value {
    let generator = SchemaSettings::draft2020_12().into_generator();
    let mut schema = generator.into_root_schema_for::<Deployment>();
    schema.insert("title".to_owned(), "Parallax deployment".into());
    schema.to_value()
}

/// A key of a deployment file.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Key {
    /// Its name with its section: `fuse.workers`.
    pub name: String,
    /// What it means: the documentation of its field.
    pub meaning: String,
    /// What it takes, as TOML: `whole number`, `"paper" or "released"`.
    pub takes: String,
}

/// A JSON schema, asked about its keys.
pub(crate) struct Shapes(pub Value);

impl Shapes {
    /// One key of a section.
    ///
    /// * `prefix`: goes before its name.
    /// * `section`: its section; empty at the top.
    pub(crate) fn key(&self, prefix: &str, section: &str, name: &str) -> Key {
        let of = if section.is_empty() {
            &self.0
        } else {
            let property = &self.0["properties"][section];
            let is_list = property.get("items").is_some();
            self.resolved(if is_list {
                &property["items"]
            } else {
                property
            })
        };
        let property = &of["properties"][name];
        let meaning = property["description"].as_str().unwrap_or_default();
        Key {
            name: format!("{prefix}{name}"),
            meaning: meaning.split_whitespace().collect::<Vec<_>>().join(" "),
            takes: self.takes(property),
        }
    }

    /// What a reference refers to; anything else is itself.
    fn resolved<'a>(&'a self, schema: &'a Value) -> &'a Value {
        let Some(reference) = schema["$ref"].as_str() else {
            return schema;
        };
        let name = reference.rsplit('/').next().unwrap_or_default();
        &self.0["$defs"][name]
    }

    /// What values a schema takes, in words.
    fn takes(&self, schema: &Value) -> String {
        let schema = self.resolved(schema);
        for choice in ["anyOf", "oneOf"] {
            if let Some(choices) = schema[choice].as_array() {
                let all = choices.iter().filter(|it| it["type"] != "null");
                return all
                    .map(|it| self.takes(it))
                    .collect::<Vec<_>>()
                    .join(" or ");
            }
        }
        if let Some(values) = schema["enum"].as_array() {
            let values: Vec<String> = values.iter().map(Value::to_string).collect();
            return values.join(" or ");
        }
        if let Some(value) = schema.get("const") {
            return value.to_string();
        }
        let types = schema["type"].as_array();
        let kind = types.map_or(&schema["type"], |types| {
            let mut known = types.iter().filter(|it| *it != "null");
            known.next().unwrap_or(&Value::Null)
        });
        match kind.as_str().unwrap_or_default() {
            "integer" => "whole number".to_owned(),
            "number" => "number".to_owned(),
            "boolean" => "true or false".to_owned(),
            "string" => "text".to_owned(),
            "array" => self.list(schema),
            _ => "table".to_owned(),
        }
    }

    fn list(&self, schema: &Value) -> String {
        let item = self.takes(&schema["items"]);
        match schema["maxItems"].as_u64() {
            Some(n) => format!("list of {n}, each: {item}"),
            None => format!("list, each: {item}"),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_schema_refuses_unknown_keys_and_asks_for_what_a_file_needs() {
        let schema = schema();
        assert_eq!(schema["additionalProperties"], false);
        let mut required: Vec<&str> = schema["required"]
            .as_array()
            .unwrap()
            .iter()
            .filter_map(Value::as_str)
            .collect();
        required.sort_unstable();
        assert_eq!(required, ["camera", "name", "output", "rig"]);
    }

    #[test]
    fn what_a_key_takes_is_told_in_words() {
        let keys = crate::keys();
        let takes = |name: &str| {
            keys.iter()
                .find(|it| it.name == name)
                .unwrap()
                .takes
                .clone()
        };
        assert_eq!(takes("fuse.workers"), "whole number");
        assert_eq!(takes("fuse.energy"), "\"paper\" or \"released\"");
        assert_eq!(takes("pose.evidence_window"), "whole number or \"all\"");
        assert_eq!(takes("capture.size"), "list of 2, each: whole number");
        assert_eq!(takes("up"), "list of 3, each: number");
        assert_eq!(takes("unit"), "\"m\" or \"cm\" or \"mm\"");
        assert_eq!(takes("rig"), "text");
    }
}
