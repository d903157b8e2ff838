use cudarc::driver::sys::{CUevent_flags, CUgraphInstantiate_flags, CUstreamCaptureMode};

use crate::query::Query;
use crate::{Gpu, GpuError, GpuField, GpuMesh, QueryOptions};

/// Microseconds of the card's clock, with warm buffers: one entry per repetition.
#[derive(Clone, Debug, Default)]
pub struct Times {
    /// Cull alone.
    pub cull: Vec<f32>,
    /// Search alone.
    pub search: Vec<f32>,
    /// Report alone.
    pub report: Vec<f32>,
    /// All of a query, from clearing the counters on, launched one by one.
    pub launched: Vec<f32>,
    /// All of a query, launched as one graph.
    pub graph: Vec<f32>,
}

impl Gpu {
    /// Repeats a query and measures its stages. Nothing is copied between host and card.
    pub fn time(
        &self,
        field: &GpuField,
        mesh: &mut GpuMesh,
        options: &QueryOptions,
        repetitions: usize,
    ) -> Result<Times, GpuError> {
        let query = Query::new(self, field, mesh, options)?;
        let event = || self.context.new_event(Some(CUevent_flags::CU_EVENT_DEFAULT));
        let events: Vec<_> = (0..=Query::STAGES).map(|_| event()).collect::<Result<_, _>>()?;
        let (start, end) = (&events[0], &events[Query::STAGES]);
        self.stream.begin_capture(CUstreamCaptureMode::CU_STREAM_CAPTURE_MODE_THREAD_LOCAL)?;
        let captured = (0..Query::STAGES).try_for_each(|stage| query.launch(self, mesh, stage));
        let flags = CUgraphInstantiate_flags::CUDA_GRAPH_INSTANTIATE_FLAG_AUTO_FREE_ON_LAUNCH;
        let graph = self.stream.end_capture(flags)?.ok_or(GpuError::Unsupported("an empty graph"))?;
        captured?;
        let mut times = Times::default();
        for _ in 0..repetitions + WARM_UP {
            start.record(&self.stream)?;
            for stage in 0..Query::STAGES {
                query.launch(self, mesh, stage)?;
                events[stage + 1].record(&self.stream)?;
            }
            self.stream.synchronize()?;
            let stage = |stage: usize| events[stage].elapsed_ms(&events[stage + 1]).map(|ms| 1e3 * ms);
            times.cull.push(stage(1)?);
            times.search.push(stage(2)?);
            times.report.push(stage(3)?);

            start.record(&self.stream)?;
            for stage in 0..Query::STAGES {
                query.launch(self, mesh, stage)?;
            }
            end.record(&self.stream)?;
            self.stream.synchronize()?;
            times.launched.push(1e3 * start.elapsed_ms(end)?);

            start.record(&self.stream)?;
            graph.launch()?;
            end.record(&self.stream)?;
            self.stream.synchronize()?;
            times.graph.push(1e3 * start.elapsed_ms(end)?);
        }
        let Times { cull, search, report, launched, graph } = &mut times;
        for list in [cull, search, report, launched, graph] {
            list.drain(..WARM_UP);
        }
        Ok(times)
    }
}

/// Repetitions that are not counted.
const WARM_UP: usize = 10;
