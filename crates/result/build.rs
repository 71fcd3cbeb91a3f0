//! Messages and descriptor set of `proto/armcal.proto`: compiled in Rust alone, without protoc.

use prost::Message as _;
use std::path::PathBuf;

fn main() -> Result<(), Box<dyn std::error::Error>> {
    println!("cargo::rerun-if-changed=proto/armcal.proto");
    let out = PathBuf::from(std::env::var_os("OUT_DIR").ok_or("cargo names no OUT_DIR")?);
    let mut compiled = protox::compile(["armcal.proto"], ["proto"])?;
    // Comments of the .proto become documentation; the descriptor set goes into every result without them.
    prost_build::Config::new().out_dir(&out).compile_fds(compiled.clone())?;
    for file in &mut compiled.file {
        file.source_code_info = None;
    }
    std::fs::write(out.join("armcal.binpb"), compiled.encode_to_vec())?;
    Ok(())
}
