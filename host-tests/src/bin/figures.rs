//! Draws the paper's figures from the core into a folder: `figures FOLDER`.

use host_tests::figures;
use std::{env, error::Error, fs, path::PathBuf};

fn main() -> Result<(), Box<dyn Error + Send + Sync>> {
    let folder = PathBuf::from(env::args_os().nth(1).ok_or("usage: figures FOLDER")?);
    fs::create_dir_all(&folder)?;
    for (name, svg) in figures::all()? {
        let path = folder.join(name);
        fs::write(&path, svg).map_err(|error| format!("cannot write {}: {error}", path.display()))?;
        println!("{}", path.display());
    }
    Ok(())
}
