fn main() {
    for path in std::env::args().skip(1) {
        let scratch = brickmend::store::Scratch::new(std::path::Path::new("/tmp"));
        let t = std::time::Instant::now();
        let opened = brickmend::io::open(
            std::path::Path::new(&path),
            &scratch,
            &brickmend::io::ReadOptions { share_bytes: 600 << 20 },
        );
        let Ok(mut source) = opened else { continue };
        let Ok(sums) = brickmend::ingest::sum_up(&mut *source, false, &brickmend::monitor::Void)
        else {
            continue;
        };
        println!(
            "{}",
            serde_json::json!({"model": path, "sums": sums, "vertices": source.vertex_count(), "s": t.elapsed().as_secs_f64()})
        );
    }
}
