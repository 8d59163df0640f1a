//! The files that a deployment names: read before anything is started.

use std::path::Path;
use std::sync::Arc;

use fmp::Model;

use crate::deployment::Deployment;
use crate::failure::{Failing as _, Failure, Kind};

/// Reads the model, of whichever format.
pub(crate) fn model(path: &Path) -> Result<Arc<Model>, Failure> {
    fmp::files::read(path).map(Arc::new).failing(Kind::Input)
}

/// Reads what the deployment names, and says what it is.
pub(crate) fn check(deployment: &Deployment) -> Result<String, Failure> {
    let model = model(&deployment.model)?;
    Ok(format!(
        "{} cameras, a model of {} parts",
        deployment.cameras.len(),
        model.n_parts()
    ))
}
