// SPDX-License-Identifier: Apache-2.0
#include "parts/interferometer.h"

#include <cmath>
#include <complex>

namespace twin {

constexpr int LEADING_ZEROS = 2;
constexpr double INL_SHAPE = 2.598076211353316;  // 3 sqrt(3) / 2: the largest of x - x^3 becomes 1

Interferometer::Interferometer(const StageParameters& parameters, uint64_t seed, uint64_t stream,
                               double clk_hz)
    : p(parameters),
      seed_(seed),
      stream_(stream),
      clk_hz_(clk_hz),
      random_(seed, stream),
      comparator_noise_(~seed, ~stream),
      spikes_a_{RandomSource(seed, stream + 1), 0, 0},
      spikes_b_{RandomSource(seed, stream + 2), 0, 0} {
    configure();
    code_sin = code_cos = 1u << (int(p.signal_bits) - 1);
}

void Interferometer::configure() {
    const double plus[] = {p.harmonic_plus_2, p.harmonic_plus_3, p.harmonic_plus_4,
                           p.harmonic_plus_5, p.harmonic_plus_6, p.harmonic_plus_7,
                           p.harmonic_plus_8};
    const double minus[] = {p.harmonic_minus_2, p.harmonic_minus_3, p.harmonic_minus_4,
                            p.harmonic_minus_5, p.harmonic_minus_6, p.harmonic_minus_7,
                            p.harmonic_minus_8};
    highest_ = 0;
    for (int k = 2; k <= HIGHEST; k++) {
        plus_[k] = plus[k - 2];
        minus_[k] = minus[k - 2];
        if (plus_[k] != 0 || minus_[k] != 0) highest_ = k;
    }
    first_bit_ = 32 - LEADING_ZEROS - int(p.signal_bits);
    draw(spikes_a_, 0);
    draw(spikes_b_, 0);
    scale_error_.configure(p, seed_, stream_);
    drift_.configure(p);
}

void Interferometer::draw(Spikes& spikes, uint64_t after) {
    if (p.comparator_spike_rate <= 0) {
        spikes.start = spikes.end = ~uint64_t(0);
        return;
    }
    spikes.start =
        after + 1 + uint64_t(spikes.random.exponential(clk_hz_ / p.comparator_spike_rate));
    const double length =
        spikes.random.uniform(p.comparator_spike_shortest, p.comparator_spike_longest) * clk_hz_;
    spikes.end = spikes.start + (length < 1 ? 1 : uint64_t(length));
}

void Interferometer::analogue(const Motion& table, double& sine, double& cosine) const {
    if (cut) {
        sine = cosine = 0;
        return;
    }
    const double x = table.position;
    const double turns = (x + scale_error_.at(x, table.time) - p.grating_offset) / p.grating_period;
    const SignalErrors e = drift_.at(x, table.time);
    double phase = 2 * M_PI * (turns - std::floor(turns)), amplitude = e.amplitude;
    if (p.signal_bandwidth > 0) {  // one pole: at a steady velocity a lag and a loss
        const double share = table.velocity / p.grating_period / p.signal_bandwidth;
        phase -= std::atan(share);
        amplitude /= std::sqrt(1 + share * share);
    }
    double s, c;
    sincos(phase, &s, &c);
    const std::complex<double> first(c, s);
    std::complex<double> power = first;
    for (int k = 2; k <= highest_; k++) {
        power *= first;
        c += (plus_[k] + minus_[k]) * power.real();
        s += (plus_[k] - minus_[k]) * power.imag();
    }
    sine = amplitude * (s + e.offset_sin);
    cosine = amplitude * (e.gain_cos * (c * e.cos_of_error - s * e.sin_of_error) + e.offset_cos);
}

uint64_t Interferometer::advance(uint64_t now, const Motion& table) {
    double sine, cosine;
    analogue(table, sine, cosine);
    if (p.comparator_noise > 0) {
        sine += p.comparator_noise * p.signal_amplitude * comparator_noise_.normal();
        cosine += p.comparator_noise * p.signal_amplitude * comparator_noise_.normal();
    }
    const double threshold = p.comparator_hysteresis * p.signal_amplitude;
    clean_a_ = clean_a_ ? cosine > -threshold : cosine > threshold;
    clean_b_ = clean_b_ ? sine > -threshold : sine > threshold;
    while (now >= spikes_a_.end) draw(spikes_a_, spikes_a_.end);
    while (now >= spikes_b_.end) draw(spikes_b_, spikes_b_.end);
    a = clean_a_ ^ (now >= spikes_a_.start);
    b = clean_b_ ^ (now >= spikes_b_.start);
    auto next = [now](const Spikes& s) { return now >= s.start ? s.end : s.start; };
    return next(spikes_a_) < next(spikes_b_) ? next(spikes_a_) : next(spikes_b_);
}

uint32_t Interferometer::convert(double value, double coupled) {
    const double half = double(1 << (int(p.signal_bits) - 1)), most = 2 * half - 1;
    double code = half + half * value + coupled + p.signal_noise * random_.normal();
    if (p.signal_inl != 0) code += p.signal_inl * INL_SHAPE * value * (1 - value * value);
    if (p.signal_spike_share > 0 && random_.uniform() < p.signal_spike_share)
        code += half * p.signal_spike_size * random_.uniform(-1, 1);
    code = std::floor(code + 0.5);
    return uint32_t(code < 0 ? 0 : code > most ? most : code);
}

void Interferometer::sample(const Motion& table, double coupled) {
    if (converter_stuck) return;
    double sine, cosine;
    analogue(table, sine, cosine);
    if (p.signal_skew != 0) {
        double earlier;
        const Motion later{table.position + table.velocity * p.signal_skew, table.velocity,
                           table.time};
        analogue(later, earlier, cosine);
    }
    code_sin = convert(sine, coupled);
    code_cos = convert(cosine, coupled);
}

}  // namespace twin
