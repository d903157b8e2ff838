//! Times of a query by the card's own clock: events around each kernel, around all of them, and around a graph of them.

use cudarc::driver::sys::{CUevent_flags, CUgraphInstantiate_flags, CUstreamCaptureMode};

use crate::{GpuError, GpuQuery};

/// Microseconds of the card's clock, with warm buffers: one entry per repetition.
#[derive(Clone, Debug, Default)]
pub struct Times {
    /// Each kernel alone, the end of the one before it to its own: those that [`GpuQuery`] tells of.
    pub kernels: Vec<Vec<f32>>,
    /// All of a query, from clearing the counters on, launched one by one.
    pub launched: Vec<f32>,
    /// All of a query, launched as one graph.
    pub graph: Vec<f32>,
}

impl GpuQuery {
    /// Repeats the query and measures its stages. Nothing is copied between host and card.
    pub fn time(&mut self, repetitions: usize) -> Result<Times, GpuError> {
        let times = self.measure(repetitions);
        self.finished(times)
    }

    fn measure(&mut self, repetitions: usize) -> Result<Times, GpuError> {
        let gpu = self.gpu().clone();
        let event = || gpu.context.new_event(Some(CUevent_flags::CU_EVENT_DEFAULT));
        let count = self.stage_count();
        let events: Vec<_> = (0..=count).map(|_| event()).collect::<Result<_, _>>()?;
        let (start, end) = (&events[0], &events[count]);
        gpu.stream.begin_capture(CUstreamCaptureMode::CU_STREAM_CAPTURE_MODE_THREAD_LOCAL)?;
        let captured = (0..count).try_for_each(|stage| self.launch(stage));
        let flags = CUgraphInstantiate_flags::CUDA_GRAPH_INSTANTIATE_FLAG_AUTO_FREE_ON_LAUNCH;
        let graph = gpu.stream.end_capture(flags);
        // A launch that fails makes the end of the capture fail, too, for no reason of its own.
        captured?;
        let graph = graph?.ok_or(GpuError::Unsupported("an empty graph"))?;
        let mut times = Times { kernels: vec![vec![]; count - 1], ..Times::default() };
        let warm_up = WARM_UP.min(repetitions);
        for _ in 0..repetitions + warm_up {
            start.record(&gpu.stream)?;
            for stage in 0..count {
                self.launch(stage)?;
                events[stage + 1].record(&gpu.stream)?;
            }
            gpu.stream.synchronize()?;
            for (kernel, ends) in times.kernels.iter_mut().zip(events[1..].windows(2)) {
                kernel.push(1e3 * ends[0].elapsed_ms(&ends[1])?);
            }

            start.record(&gpu.stream)?;
            for stage in 0..count {
                self.launch(stage)?;
            }
            end.record(&gpu.stream)?;
            gpu.stream.synchronize()?;
            times.launched.push(1e3 * start.elapsed_ms(end)?);

            start.record(&gpu.stream)?;
            graph.launch()?;
            end.record(&gpu.stream)?;
            gpu.stream.synchronize()?;
            times.graph.push(1e3 * start.elapsed_ms(end)?);
        }
        for list in times.kernels.iter_mut().chain([&mut times.launched, &mut times.graph]) {
            list.drain(..warm_up);
        }
        Ok(times)
    }
}

/// Repetitions that are not counted, but no more than are.
const WARM_UP: usize = 10;
