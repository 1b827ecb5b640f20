/*
  dem_contact.h - force of one contact between two bodies that are not bonded.  Eqs (5.20)-(5.31), docs/theory.md

  Needs no model: whoever finds a contact (particle and particle, particle and tool) fills a DemContactMotion and calls
  DemContactStep() once per step with that contact's own history; DemContactPart() when the bodies have parted.

    first, second   the two bodies; the force found acts on the first, its opposite on the second
    n               unit normal at the contact, from the second to the first: a pushing force on the first is along +n
    overlap         > 0 while they touch [m]; the sum of the radii less the distance, less a stress-free offset if any
    v               velocity of the first relative to the second AT THE CONTACT POINT, over the step that led here [m/s]
                    (half-step velocities: v dt is the displacement since the last call)
    spin            angular velocity of the first less that of the second [rad/s]
    turn            mean angular velocity of both about n: ((w1 + w2) . n)/2 [rad/s]; it carries the history along
    radius          1/(1/r1 + 1/r2); a plane has 1/r2 = 0; a hollow side has 1/r2 < 0 [m]
    size            radius, for spheres; discs of thickness b: b/4 for two, b/2 for one against a plane (linear law only)
    mass            1/(1/m1 + 1/m2); a wall has 1/m2 = 0 [kg]

  A zeroed history is a contact that has not begun. The caller turns the force into couples with its own arms.
*/
#pragma once
#include "base.h"

/* Into the loop of the caller, whatever the size: only so it is vectorised. */
#define DEM_INLINE static inline __attribute__((always_inline))

typedef enum { DEM_CONTACT_LINEAR, DEM_CONTACT_HERTZ } DemContactLaw;

/* What a user says of two materials; zero is rigid (young), none (rolling, twisting), or "derive it" where stated. */
typedef struct {
  DemContactLaw law;
  PetscReal     stiffness;        /* linear: [Pa], spring = stiffness x size; 0: the harmonic mean of both Young's moduli */
  PetscReal     ratio;            /* tangential / normal stiffness; 0: Mindlin's 4 G* / E* */
  PetscReal     restitution;      /* (0, 1]: speed after / before of a normal impact. Below DEM_CONTACT_LEAST it is that */
  PetscReal     friction;         /* dynamic Coulomb coefficient */
  PetscReal     friction_static;  /* >= friction; 0: the same */
  PetscReal     rolling;          /* rolling resistance: couple <= rolling x radius x normal force */
  PetscReal     twisting;         /* the same about the normal */
  PetscReal     rolling_damping;  /* fraction of critical of the rolling spring's dashpot */
} DemContactChoice;

#define DEM_CONTACT_LEAST 1e-3 /* smallest restitution: a dashpot that stops a body dead would need a step of no length */

typedef struct {
  PetscReal young, poisson; /* [Pa], -; young 0 = rigid */
} DemContactElastic;

/* The same, ready for use: S = modulus sqrt(size y), y = overlap (Hertz) or size (linear), is dF/d(overlap).  Eq. (5.20) */
typedef struct {
  PetscReal modulus;             /* [Pa] 2 E* or the linear stiffness */
  PetscReal hertz;               /* 1 or 0 */
  PetscReal share;               /* force / (S overlap): 2/3 or 1 */
  PetscReal store;               /* energy / (S overlap^2): 4/15 or 1/2 */
  PetscReal drag, drag_tangent;  /* dashpot / sqrt(S mass): 2 zeta (linear), 2 zeta sqrt(5/6) (Hertz); and with the tangential spring */
  PetscReal ratio;               /* tangential spring / S */
  PetscReal mu_static, mu;
  PetscReal roll, roll_spring, roll_drag; /* coefficient, spring / (S radius^2), dashpot / (radius sqrt(spring mass)) */
  PetscReal twist, twist_spring;
  PetscReal zeta;                /* dashpot as a fraction of critical (linear); the same number for Hertz */
} DemContactPair;

typedef struct {
  PetscReal n[3], overlap, v[3], spin[3], turn, radius, size, mass;
} DemContactMotion;

/* 11 numbers that belong to one contact; a checkpoint stores them as they are. Vectors lie in the contact plane, in space. */
typedef struct {
  PetscReal slip[3];  /* elastic tangential displacement of the first against the second [m] */
  PetscReal overlap;  /* of the last call [m]; negative when the contact was sliding; 0: no contact yet */
  PetscReal drag[3];  /* dashpot force on the first at the last call [N], for the work it does until the next */
  PetscReal roll[3];  /* elastic rolling angle [rad] */
  PetscReal twist;    /* elastic angle about n [rad] */
} DemContactHistory;

typedef struct {
  PetscReal force[3];          /* on the first [N], at the contact point */
  PetscReal couple[3];         /* on the first [N m]: rolling and twisting resistance */
  PetscReal friction, damping; /* energy taken since the last call [J].  Eqs (5.29), (5.30) */
} DemContactForce;

PetscErrorCode DemContactPairSet(DemContactPair *pair, const DemContactChoice *choice, DemContactElastic first, DemContactElastic second);
/* Fraction of critical damping that gives a restitution e, for a force that never pulls.  Eq. (5.24) */
PetscReal DemContactDamping(PetscReal e);

/* dF/d(overlap) [N/m].  Eq. (5.20) */
DEM_INLINE PetscReal DemContactStiffness(const DemContactPair *pair, PetscReal size, PetscReal overlap)
{
  return pair->modulus * PetscSqrtReal(size * (pair->hertz * overlap + (1 - pair->hertz) * size));
}

/* Keep a vector's length while n turns and the pair spins by `angle` about it.  Eq. (5.25) */
DEM_INLINE void DemContactCarry(const PetscReal n[3], PetscReal angle, PetscReal a[3])
{
  const PetscReal was = a[0] * a[0] + a[1] * a[1] + a[2] * a[2];
  PetscReal       x = a[0] + angle * (n[1] * a[2] - n[2] * a[1]), y = a[1] + angle * (n[2] * a[0] - n[0] * a[2]), z = a[2] + angle * (n[0] * a[1] - n[1] * a[0]);
  const PetscReal along = x * n[0] + y * n[1] + z * n[2];

  x -= along * n[0];
  y -= along * n[1];
  z -= along * n[2];
  const PetscReal is = x * x + y * y + z * z, scale = PetscSqrtReal(was / (is > 1e-300 ? is : 1e-300));

  a[0] = scale * x;
  a[1] = scale * y;
  a[2] = scale * z;
}

/*
  A spring k |a|^2/2 in the contact plane, stretched by `more` and cut at `most_static`, or at `most` once it gives way.
  k_old: its stiffness a step ago. Returns the energy that friction took; *slides tells whether it gave way.  Eqs (5.26)-(5.29)
*/
DEM_INLINE PetscReal DemContactSpring(PetscReal k_old, PetscReal k, PetscReal carry, const PetscReal more[3], PetscReal most_static, PetscReal most, PetscReal a[3], PetscReal force[3], PetscReal *length, PetscReal *slides)
{
  const PetscReal ox = a[0], oy = a[1], oz = a[2];
  const PetscReal px = carry * ox, py = carry * oy, pz = carry * oz; /* while the normal force grows the spring keeps its force */
  const PetscReal tx = px + more[0], ty = py + more[1], tz = pz + more[2];
  const PetscReal pull = k * PetscSqrtReal(tx * tx + ty * ty + tz * tz), gives = pull > most_static ? 1 : 0;
  const PetscReal keep = 1 + gives * (most / (pull > 1e-150 ? pull : 1e-150) - 1); /* no division behind a condition: GCC would leave the loop scalar */
  const PetscReal nx = keep * tx, ny = keep * ty, nz = keep * tz;
  PetscReal       lost = 0.5 * (ox * ox + oy * oy + oz * oz) * (k_old - k * carry * carry); /* never negative: carry = min(1, k_old/k) */

  lost += 0.5 * (k_old - k * carry) * (ox * more[0] + oy * more[1] + oz * more[2]); /* half the step was done against the old force */
  lost += 0.5 * k * ((px + nx) * (tx - nx) + (py + ny) * (ty - ny) + (pz + nz) * (tz - nz));
  a[0]     = nx;
  a[1]     = ny;
  a[2]     = nz;
  force[0] = -k * nx;
  force[1] = -k * ny;
  force[2] = -k * nz;
  *length  = keep * pull;
  *slides  = gives;
  return lost;
}

/* One step of a contact with overlap > 0. `turns` (a constant at the call): with rolling and twisting resistance. */
DEM_INLINE void DemContactStep(const DemContactPair *pair, const DemContactMotion *m, PetscReal dt, int turns, DemContactHistory *h, DemContactForce *out)
{
  const PetscReal *n = m->n, *v = m->v;
  const PetscReal  before = PetscAbsReal(h->overlap);
  const PetscReal  S = DemContactStiffness(pair, m->size, m->overlap), S_old = DemContactStiffness(pair, m->size, before), grown = S_old / S, carry = grown < 1 ? grown : 1;
  const PetscReal  vn = v[0] * n[0] + v[1] * n[1] + v[2] * n[2];
  const PetscReal  elastic = pair->share * S * m->overlap, root = PetscSqrtReal(S * m->mass);
  const PetscReal  pushes = -pair->drag * root * vn, drag = pushes > -elastic ? pushes : -elastic, N = elastic + drag; /* never pulls.  Eq. (5.23) */
  const PetscReal  vt[3] = {v[0] - vn * n[0], v[1] - vn * n[1], v[2] - vn * n[2]}, more[3] = {dt * vt[0], dt * vt[1], dt * vt[2]};
  const PetscReal  most = pair->mu * N, most_now = h->overlap < 0 ? most : pair->mu_static * N;
  PetscReal        tangent[3], length, slides;

  DemContactCarry(n, dt * m->turn, h->slip);
  out->friction = DemContactSpring(pair->ratio * S_old, pair->ratio * S, carry, more, most_now, most, h->slip, tangent, &length, &slides);

  /* Dashpot of the sticking spring, within what Coulomb leaves: it always opposes the motion.  Eq. (5.28) */
  const PetscReal viscous = pair->drag_tangent * root, speed = viscous * PetscSqrtReal(vt[0] * vt[0] + vt[1] * vt[1] + vt[2] * vt[2]);
  const PetscReal room = most_now > length ? most_now - length : 0, share = room / (speed > 1e-150 ? speed : 1e-150), part = (1 - slides) * (share < 1 ? share : 1);
  const PetscReal dx = drag * n[0] - part * viscous * vt[0], dy = drag * n[1] - part * viscous * vt[1], dz = drag * n[2] - part * viscous * vt[2];

  out->damping  = -0.5 * dt * ((dx + h->drag[0]) * v[0] + (dy + h->drag[1]) * v[1] + (dz + h->drag[2]) * v[2]);
  h->drag[0]    = dx;
  h->drag[1]    = dy;
  h->drag[2]    = dz;
  h->overlap    = slides > 0 ? -m->overlap : m->overlap;
  out->force[0] = elastic * n[0] + tangent[0] + dx;
  out->force[1] = elastic * n[1] + tangent[1] + dy;
  out->force[2] = elastic * n[2] + tangent[2] + dz;
  out->couple[0] = out->couple[1] = out->couple[2] = 0;

  if (turns) { /* Eq. (5.31) */
    const PetscReal R2 = m->radius * m->radius, wn = m->spin[0] * n[0] + m->spin[1] * n[1] + m->spin[2] * n[2];
    const PetscReal w[3] = {m->spin[0] - wn * n[0], m->spin[1] - wn * n[1], m->spin[2] - wn * n[2]}, turned[3] = {dt * w[0], dt * w[1], dt * w[2]}, twisted[3] = {dt * wn, 0, 0};
    const PetscReal k = pair->roll_spring * R2, kt = pair->twist_spring * R2, limit = pair->roll * m->radius * N, limit_twist = pair->twist * m->radius * N;
    PetscReal       twist[3] = {h->twist, 0, 0}, about[3];

    DemContactCarry(n, dt * m->turn, h->roll);
    out->friction += DemContactSpring(k * S_old, k * S, carry, turned, limit, limit, h->roll, out->couple, &length, &slides);
    const PetscReal c = slides > 0 ? 0 : pair->roll_drag * m->radius * PetscSqrtReal(k * S * m->mass);

    out->friction += DemContactSpring(kt * S_old, kt * S, carry, twisted, limit_twist, limit_twist, twist, about, &length, &slides);
    h->twist = twist[0];
    out->damping += dt * c * (w[0] * w[0] + w[1] * w[1] + w[2] * w[2]);
    for (int d = 0; d < 3; d++) out->couple[d] += about[0] * n[d] - c * w[d];
  }
}

/* The bodies no longer touch: what the last forces did on the way, and what the springs held, is lost; the history is cleared. */
static inline void DemContactPart(const DemContactPair *pair, const PetscReal v[3], PetscReal radius, PetscReal size, PetscReal dt, int turns, DemContactHistory *h, PetscReal *friction, PetscReal *damping)
{
  const PetscReal S = DemContactStiffness(pair, size, PetscAbsReal(h->overlap)), k = pair->ratio * S, R2 = radius * radius;

  *friction = 0.5 * k * (h->slip[0] * (h->slip[0] + dt * v[0]) + h->slip[1] * (h->slip[1] + dt * v[1]) + h->slip[2] * (h->slip[2] + dt * v[2]));
  *damping  = -0.5 * dt * (h->drag[0] * v[0] + h->drag[1] * v[1] + h->drag[2] * v[2]);
  h->slip[0] = h->slip[1] = h->slip[2] = h->drag[0] = h->drag[1] = h->drag[2] = h->overlap = 0;
  if (turns) {
    *friction += 0.5 * S * R2 * (pair->roll_spring * (h->roll[0] * h->roll[0] + h->roll[1] * h->roll[1] + h->roll[2] * h->roll[2]) + pair->twist_spring * h->twist * h->twist);
    h->roll[0] = h->roll[1] = h->roll[2] = h->twist = 0;
  }
}

/* Energy stored in the springs of a contact [J]; minus its gradient is the elastic force.  Eq. (5.22) */
static inline PetscReal DemContactEnergy(const DemContactPair *pair, PetscReal radius, PetscReal size, PetscReal overlap, const DemContactHistory *h)
{
  const PetscReal S = DemContactStiffness(pair, size, overlap), s2 = h->slip[0] * h->slip[0] + h->slip[1] * h->slip[1] + h->slip[2] * h->slip[2];
  const PetscReal a2 = h->roll[0] * h->roll[0] + h->roll[1] * h->roll[1] + h->roll[2] * h->roll[2];

  return S * (pair->store * overlap * overlap + 0.5 * pair->ratio * s2 + 0.5 * radius * radius * (pair->roll_spring * a2 + pair->twist_spring * h->twist * h->twist));
}
