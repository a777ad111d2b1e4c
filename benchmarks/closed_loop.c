// The closed loop of closed_loop.py, plainly in C: the benchmark plant under the default regulator.
//
// What that flight does not meet is left out: a single motor, noise, disturbances, locks, effects of
// a real stage; laws other than the default, jumps of the reference, late currents. What it does not
// meet but must look for is looked for; then the loop ends. records.h is written by the benchmark,
// of the very records that the compiled loop works on.

#include <math.h>

#include "records.h"

typedef const struct machine Machine;
typedef struct stage Stage;
typedef struct axis Axis;
typedef struct sample Sample;
typedef const struct settings Settings;

enum { WENT_WELL, MET_A_LIMIT };

static const double pi = 3.14159265358979323846, reserve = 1.1, creep = 1e-5, rest = 0.1;

static double square(double x) { return x * x; }
static double tanh_(double x) { return 1.0 - 2.0 / (1.0 + exp(2.0 * x)); }
static double within(double x, double limit) { return fmin(fmax(x, -limit), limit); }

// -- the machine

struct force { double k_1, k_2, k_3, k_h; };

static struct force force_coefficients(Machine *m, double gap) {
  double e = exp(pi / m->tau * (m->h_m + gap));
  double sinh_ = 0.5 * (e - 1.0 / e), coth = 0.5 * (e + 1.0 / e) / sinh_;
  double u = m->b_0 / (2.0 * gap);
  double gamma = 4.0 / pi * (u * atan(u) - 0.5 * log(1.0 + u * u));
  double winding = coth * (1.0 - gap * gamma / m->t_1), magnet = m->B_0 / sinh_;
  double depth = gap + m->b_0 / 2.0 + m->h_m / m->mu_rec;
  double permeance = 1.0 - m->b_0 * m->b_0 / (4.0 * m->t_1 * depth);
  return (struct force){
    m->K_v1 * permeance * magnet * magnet,
    m->K_v2 * permeance * magnet * winding,
    m->K_v3 * permeance * winding * winding,
    m->K_h * permeance * winding / (coth * sinh_),
  };
}

static struct force tabulated(const struct effects_motors_forces *table, Machine *m, double gap) {
  double place = (gap - table->first) * table->per_metre, k[4];
  if (!(place >= 0.0 && place < sizeof table->row / sizeof *table->row))
    return force_coefficients(m, gap);
  int number = place;
  double u = place - number - 0.5;
  for (int n = 0; n < 4; n++) k[n] = table->row[number][5][n];
  for (int power = 4; power >= 0; power--)
    for (int n = 0; n < 4; n++) k[n] = k[n] * u + table->row[number][power][n];
  return (struct force){k[0], k[1], k[2], k[3]};
}

static void gaps_of(Machine *m, double y, double phi, double theta, double gap[4]) {
  double tilt_phi = m->r * sin(phi), tilt_theta = m->r * sin(theta);
  gap[0] = y - tilt_phi, gap[1] = y + tilt_theta, gap[2] = y + tilt_phi, gap[3] = y - tilt_theta;
}

// -- the stage

static void derivative(const Stage *s, Machine *m, const double *x, const double *i, double *rate) {
  double gap[4], v[4], h[4];
  gaps_of(m, x[0], x[6], x[8], gap);
  for (int k = 0; k < 4; k++) {
    struct force f = tabulated(&s->effects.motors.forces, m, gap[k]);
    v[k] = -f.k_1 + f.k_2 * i[k] - f.k_3 * (i[k] * i[k] + i[4 + k] * i[4 + k]);
    h[k] = -f.k_h * i[4 + k];
  }
  double lever = m->k_rot / m->M_y;
  double moved[5] = {
    m->G + (v[0] + v[1] + v[2] + v[3]) / m->M_y,
    (h[1] + h[3]) / m->M_x,
    (h[0] + h[2]) / m->M_z,
    lever * (v[2] - v[0]) - m->k_s_phi * x[6],
    lever * (v[1] - v[3]) - m->k_s_theta * x[8],
  };
  for (int a = 0; a < 5; a++) {
    double speed = x[2 * a + 1];
    rate[2 * a] = speed;
    rate[2 * a + 1] =
      moved[a] - s->viscous[a] * speed - s->coulomb[a] * tanh_(speed / s->coulomb_velocity[a]);
  }
}

static int runge_kutta(Stage *s, Machine *m, double current[3][8]) {
  double k_1[10], k_2[10], k_3[10], k_4[10], probe[10], *x = s->state, step = s->step;
  derivative(s, m, x, current[0], k_1);
  for (int i = 0; i < 10; i++) probe[i] = x[i] + 0.5 * step * k_1[i];
  derivative(s, m, probe, current[1], k_2);
  for (int i = 0; i < 10; i++) probe[i] = x[i] + 0.5 * step * k_2[i];
  derivative(s, m, probe, current[1], k_3);
  for (int i = 0; i < 10; i++) probe[i] = x[i] + step * k_3[i];
  derivative(s, m, probe, current[2], k_4);
  for (int i = 0; i < 10; i++) x[i] += step / 6.0 * (k_1[i] + 2.0 * (k_2[i] + k_3[i]) + k_4[i]);
  double reach = s->seat_radius * fmax(fabs(x[6]), fabs(x[8]));
  int met = x[0] + reach > s->upper[0] || x[0] - reach < s->lower[0];
  for (int a = 1; a < 5; a++) met |= x[2 * a] > s->upper[a] || x[2 * a] < s->lower[a];
  return met ? MET_A_LIMIT : WENT_WELL;
}

static int phase(Stage *s, int number, double current) {
  double limit = s->limited[number] ? s->continuous : s->peak;
  s->load[number] += s->thermal_gain * (square(current / s->continuous) - s->load[number]);
  return fabs(current) > limit || s->load[number] >= 1.0 ? MET_A_LIMIT : WENT_WELL;
}

static int amplifiers(Stage *s, Machine *m) {
  int met = 0;
  double c[2], n[2];
  for (int first = 0; first < 2; first++) {
    double angle = pi * s->state[first ? 2 : 4] / m->tau;
    c[first] = cos(angle), n[first] = sin(angle);
  }
  for (int k = 0; k < 4; k++) {
    double i_d = s->command[k], i_q = s->command[4 + k];
    double alpha = i_d * c[k % 2] - i_q * n[k % 2];
    double beta = i_d * n[k % 2] + i_q * c[k % 2];
    met |= phase(s, 3 * k, alpha);
    met |= phase(s, 3 * k + 1, -0.5 * alpha + 0.5 * sqrt(3.0) * beta);
    met |= phase(s, 3 * k + 2, -0.5 * alpha - 0.5 * sqrt(3.0) * beta);
    s->target[k] = i_d, s->target[4 + k] = i_q;
  }
  return met;
}

static int advance(Stage *s) {
  Machine *m = (Machine *)s->machine;
  double lag[8], current[3][8];
  int met = amplifiers(s, m);
  for (int i = 0; i < 8; i++) lag[i] = s->flowing[i] - s->target[i];
  for (int n = 0; n < s->substeps && !met; n++) {
    for (int i = 0; i < 8; i++) {
      current[0][i] = s->target[i] + s->lag_start * lag[i];
      current[1][i] = s->target[i] + s->lag_middle * lag[i];
      lag[i] *= s->lag_end;
      current[2][i] = s->target[i] + lag[i];
    }
    met = runge_kutta(s, m, current);
  }
  for (int i = 0; i < 8; i++) s->flowing[i] = current[2][i];
  s->sample++;
  return met;
}

static void encode(Stage *s) {
  Machine *m = (Machine *)s->machine;
  gaps_of(m, s->state[0], s->state[6], s->state[8], s->reading);
  s->reading[4] = s->state[2], s->reading[5] = s->state[4];
  for (int i = 0; i < 6; i++) {
    double count = i < 4 ? s->gap_resolution : s->horizontal_resolution;
    s->effects.sensor.own[i] = s->reading[i];
    if (count > 0.0) s->reading[i] = floor(s->reading[i] / count + 0.5) * count;
  }
}

// -- the regulator

static int measure(Settings *c, Machine *m, Sample *p, const double *g) {
  p->output[0] = 0.25 * (g[0] + g[1] + g[2] + g[3]);
  p->output[1] = g[4], p->output[2] = g[5];
  p->output[3] = asin((g[2] - g[0]) / (2.0 * m->r));
  p->output[4] = asin((g[1] - g[3]) / (2.0 * m->r));
  int bad = !(fabs(g[0] + g[2] - g[1] - g[3]) <= c->warp);
  for (int a = 0; a < 5; a++) {
    bad |= !(p->output[a] >= c->lower[a] && p->output[a] <= c->upper[a]);
    p->position[a] = p->output[a];
  }
  return bad ? MET_A_LIMIT : WENT_WELL;
}

static double believed(double difference, double half, double doubt) {
  return difference - doubt * within(difference, half);
}

static void surprises(Settings *c, Machine *m, Axis *a, const double *g) {
  double gap[4], found[4], half = c->half_gap;
  double doubt = c->doubt * (1.0 - fmax(fmax(a[0].awake, a[3].awake), a[4].awake));
  gaps_of(m, a[0].estimated_position, a[3].estimated_position, a[4].estimated_position, gap);
  for (int k = 0; k < 4; k++) found[k] = believed(g[k] - gap[k], half, doubt);
  a[0].surprise = 0.25 * (found[0] + found[1] + found[2] + found[3]);
  a[3].surprise = (found[2] - found[0]) / (2.0 * m->r);
  a[4].surprise = (found[1] - found[3]) / (2.0 * m->r);
  for (int k = 1; k < 3; k++) {
    double difference = g[3 + k] - a[k].estimated_position;
    a[k].surprise = believed(difference, c->half_horizontal, c->doubt * (1.0 - a[k].awake));
  }
}

static void virtual_input(
  Settings *c, Sample *p, Axis *a, int k, double position, double velocity, double acceleration
) {
  double measured = p->position[k];
  if (a->fresh) {
    a->fresh = 0, a->filtered_position = measured;
    a->estimated_position = measured, a->estimated_velocity = 0.0;
    a->surprise = 0.0, a->reference_position = position;
  } else {
    double middle = 0.5 * (velocity + a->smooth_velocity);
    a->filtered_velocity += c->filter_forget[k] * (middle - a->filtered_velocity);
  }
  a->transition_elapsed += c->period;
  double speed = fabs(position - a->reference_position) / c->period;
  a->rested = fmax(speed, fabs(velocity)) > creep ? 0.0 : a->rested + c->period;
  a->awake += c->waking * ((a->rested < rest ? 1.0 : 0.0) - a->awake);
  a->reference_position = a->smooth_position = position;
  a->reference_velocity = a->smooth_velocity = velocity;
  a->reference_acceleration = a->wanted_acceleration = acceleration;
  p->learned_error[k] = within(measured - position, c->learned_error[k]);
  a->estimated_position += c->observer_position[k] * a->surprise;
  a->estimated_velocity += c->observer_velocity[k] * a->surprise;
  a->error = within(a->estimated_position - position, c->error_limit[k]);
  a->bump *= c->fade;
  p->error[k] = measured - position;
  p->error_rate[k] = a->estimated_velocity - velocity;
  double w = c->error_gain[k] * a->error + c->rate_gain[k] * p->error_rate[k];
  if (velocity != 0.0 && a->bristle != copysign(1.0, velocity)) {
    double turned = -expm1(-fabs(velocity) * c->period / c->friction_way[k]);
    a->bristle += turned * (copysign(1.0, velocity) - a->bristle);
  }
  w += p->internal_model[k] + a->bump;
  p->virtual_input[k] = w + acceleration + a->friction * a->bristle;
}

static double pair_need(double i_q, double one, double two, double difference, double least) {
  return fmax(
    2.0 * fmax(reserve * square(one * i_q), least) - difference,
    2.0 * fmax(reserve * square(two * i_q), least) + difference
  );
}

static double quadrature_limit(Settings *c, const double *a, const double *b, const double *pull) {
  double largest = c->current;
  for (int k = 0; k < 4; k += 2) {
    double root = (a[k] * a[k] + pull[k] - square(c->current * b[k])) / (2.0 * a[k]);
    largest = fmin(largest, sqrt(fmax(pull[k] - square(fmax(root, 0.0)), 0.0)) / b[k]);
  }
  return largest;
}

static void currents(Settings *c, Machine *m, Sample *p, double *direct, double *quadrature) {
  double gap[4], a[4], b[4], h[4], pull[4];
  const double *x = p->position, *w = p->virtual_input;
  gaps_of(m, x[0], x[3], x[4], gap);
  for (int k = 0; k < 4; k++) {
    struct force f = force_coefficients(m, gap[k]);
    a[k] = sqrt(f.k_1), b[k] = sqrt(f.k_3), h[k] = f.k_h;
  }
  double h_x = -(h[1] + h[3]) / m->M_x, h_z = -(h[0] + h[2]) / m->M_z;
  double u_x = w[1] / h_x, u_z = w[2] / h_z;
  double wanted = m->M_y * (m->G - w[0]), least = c->least_attraction * m->M_y * m->G;
  double phi = m->I_x / m->r * (w[3] + m->k_s_phi * x[3]);
  double theta = m->I_x / m->r * (w[4] + m->k_s_theta * x[4]);
  double total = fmax(wanted, least), most = c->tilt * total;
  int limited = wanted < least || fabs(phi) > most || fabs(theta) > most;
  phi = within(phi, most), theta = within(theta, most);
  double need_z = pair_need(within(u_z, c->current), b[0], b[2], phi, 0.25 * least);
  double need_x = pair_need(within(u_x, c->current), b[1], b[3], -theta, 0.25 * least);
  double along_z = need_x + need_z > total ? total * need_z / (need_x + need_z)
                                           : fmin(fmax(0.5 * total, need_z), total - need_x);
  double along_x = total - along_z;
  limited |= fabs(phi) > along_z || fabs(theta) > along_x;
  phi = within(phi, along_z), theta = within(theta, along_x);
  pull[0] = 0.5 * (along_z + phi), pull[2] = 0.5 * (along_z - phi);
  pull[1] = 0.5 * (along_x - theta), pull[3] = 0.5 * (along_x + theta);
  double sat_x = within(u_x, quadrature_limit(c, a + 1, b + 1, pull + 1));
  double sat_z = within(u_z, quadrature_limit(c, a, b, pull));
  limited |= sat_x != u_x || sat_z != u_z;
  for (int k = 0; k < 4; k++) {
    quadrature[k] = k % 2 ? sat_x : sat_z;
    double left = pull[k] - square(b[k] * quadrature[k]);
    double free = (a[k] - sqrt(fmax(left, 0.0))) / b[k];
    double bound = sqrt(fmax(square(c->current) - square(quadrature[k]), 0.0));
    direct[k] = within(free, bound * (1.0 + 1e-12));
    limited |= left + 1e-9 * pull[k] < 0.0 || fabs(direct[k] - free) > 1e-9;
    pull[k] = square(a[k] - b[k] * direct[k]) + square(b[k] * quadrature[k]);
  }
  double lever = m->r / m->I_x;
  double made[5] = {
    m->G - (pull[0] + pull[1] + pull[2] + pull[3]) / m->M_y,
    h_x * sat_x,
    h_z * sat_z,
    lever * (pull[0] - pull[2]) - m->k_s_phi * x[3],
    lever * (pull[3] - pull[1]) - m->k_s_theta * x[4],
  };
  for (int k = 0; k < 5; k++) p->realised[k] = limited ? made[k] : w[k];
}

static void learn(Settings *c, Sample *p, Axis *a, int k) {
  double step = c->period, made = p->realised[k];
  a->estimated_position += step * (a->estimated_velocity + 0.5 * step * made);
  a->estimated_velocity += step * made;
  if (!(fabs(a->error) < c->learned_error[k]) || a->smooth_velocity == 0.0) return;
  double missing = made - a->wanted_acceleration - a->load - a->friction * a->bristle;
  a->load += c->friction_gain * missing;
  double level = a->friction + c->friction_gain * missing * a->bristle;
  a->friction = fmin(fmax(level, 0.0), c->friction_limit[k]);
}

static void advance_models(
  Settings *c, Sample *p, Axis *axes, const struct model *models, const double *transition,
  double *xi, int states
) {
  double following[states];
  for (int k = 0; k < 5; k++, models += states, xi += states) {
    double awake = axes[k].awake, kept = 1.0 - c->waking * (1.0 - awake);
    double lost = p->realised[k] - p->virtual_input[k];
    for (int row = 0; row < states; row++, transition += states) {
      const struct model *each = models + row;
      double told = each->oscillates ? awake * p->learned_error[k] : p->learned_error[k];
      double value = each->drive * told + each->antiwindup * lost;
      for (int column = each->first; column < each->end; column++)
        value += transition[column] * xi[column];
      following[row] = each->oscillates ? kept * value : value;
    }
    for (int row = 0; row < states; row++) xi[row] = following[row];
  }
}

static int control(
  struct control *r, const struct model *models, const double *transition, double *xi, int states,
  const double *reading, const double *position, const double *velocity,
  const double *acceleration, double *answer
) {
  Settings *c = &r->settings;
  Machine *m = (Machine *)c->machine;
  Sample *p = &r->sample;
  if (measure(c, m, p, reading)) return MET_A_LIMIT;
  for (int k = 0; k < 5; k++) {
    p->internal_model[k] = 0.0;
    for (int row = 0; row < states; row++)
      p->internal_model[k] += models[k * states + row].output * xi[k * states + row];
  }
  surprises(c, m, r->axes, reading);
  for (int k = 0; k < 5; k++)
    virtual_input(c, p, r->axes + k, k, position[k], velocity[k], acceleration[k]);
  currents(c, m, p, answer, answer + 4);
  for (int k = 0; k < 5; k++) learn(c, p, r->axes + k, k);
  advance_models(c, p, r->axes, models, transition, xi, states);
  return WENT_WELL;
}

// All samples, or as many as meet no limit; their number.
int closed_loop(
  int samples, Stage *s, struct control *r, const struct model *models, const double *transition,
  double *xi, int states, const double *position, const double *velocity,
  const double *acceleration, double *state, double *reading, double *own, double *current
) {
  for (int n = 0; n < samples; n++) {
    for (int i = 0; i < 10; i++) state[10 * n + i] = s->state[i];
    encode(s);
    for (int i = 0; i < 6; i++) reading[6 * n + i] = s->reading[i];
    for (int i = 0; i < 6; i++) own[6 * n + i] = s->effects.sensor.own[i];
    const double *at = position + 5 * n, *rate = velocity + 5 * n, *bend = acceleration + 5 * n;
    double *answer = current + 8 * n;
    if (control(r, models, transition, xi, states, s->reading, at, rate, bend, answer)) return n;
    for (int i = 0; i < 8; i++) s->command[i] = answer[i];
    if (advance(s)) return n;
  }
  return samples;
}
