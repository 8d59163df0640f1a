//! From the section `[triangulate]` of a deployment to the settings of the skeleton step.

use deployment::triangulate::Combine;

/// How a view's pose is made of those of its pairs.
pub fn combine(from: Combine) -> pipeline::Combine {
    match from {
        Combine::Mean => pipeline::Combine::Mean,
        Combine::Consensus => pipeline::Combine::Consensus,
    }
}

#[cfg(test)]
mod tests {
    use deployment::triangulate::Config;
    use pipeline::SkeletonSettings;

    use super::*;

    #[test]
    fn the_defaults_are_those_of_the_step() {
        let (config, step) = (Config::default(), SkeletonSettings::default());
        assert_eq!(config.loss_px, step.triangulation.loss_px);
        assert_eq!(config.error_weight, step.error_weight);
        assert_eq!(combine(config.combine), step.combine);
        assert_eq!(config.joints, step.joints.name);
    }
}
