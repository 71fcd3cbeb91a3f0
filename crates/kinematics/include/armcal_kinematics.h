/* A calibrated arm in a program: the model.json of `armcal run` as a function.
 *
 * Joints in [rad] (sliding: [m]), metres, kilograms, seconds, degrees Celsius. Quaternions are x, y, z, w.
 *
 * Threads: an armcal_arm does not change and may be used by any number of threads; an armcal_motion by one at a time. No
 * function starts a thread, reads a file or a clock, or keeps a pointer that it was given.
 *
 * Errors: functions that return an int32_t return ARMCAL_OK or another code; armcal_error() then says in a sentence what went
 * wrong, and outputs are untouched. Nothing is thrown or ends the program.
 *
 * Link with -larmcal_kinematics. The library needs the C library and nothing else.
 */
#ifndef ARMCAL_KINEMATICS_H
#define ARMCAL_KINEMATICS_H

#include <stddef.h>
#include <stdint.h>

#ifdef __cplusplus
extern "C" {
#endif

enum {
    ARMCAL_OK = 0,
    ARMCAL_ARGUMENT = 1,    /* an argument makes no sense: NULL, not finite, a number that is not known */
    ARMCAL_MODEL = 2,       /* the text is no model.json of this version */
    ARMCAL_UNREACHABLE = 3, /* out of reach, behind a limit, or singular there */
    ARMCAL_INTERNAL = 4     /* a mistake in armcal */
};

/* Kinds of names. */
enum {
    ARMCAL_JOINT = 0,     /* in the order of every vector of joints */
    ARMCAL_TIP = 1,       /* the tip, of several arms each one's, then markers */
    ARMCAL_RECORDING = 2, /* of the calibration */
    ARMCAL_EFFECT = 3,    /* in the model */
    ARMCAL_MISSING = 4    /* what the diagnosis would add: what the model lacks stays in the error */
};

typedef struct armcal_arm armcal_arm;
typedef struct armcal_motion armcal_motion;

/* Under which conditions the arm is driven. NULL in its place: the first tip, in the world, as in the last recording. */
typedef struct {
    size_t tip;           /* which, of several */
    int32_t in_base;      /* poses are in the base of that tip's arm, as calibrated; 0: in the world of the measurement */
    int32_t recording;    /* as in which recording: what has happened until then; -1: the last */
    double load_kg;       /* at the tip; NAN: that of the recording */
    double temperature_c; /* NAN: that of the recording */
} armcal_conditions;

typedef struct {
    double position_m[3];
    double quaternion_xyzw[4];
} armcal_pose;

/* By how much the calibrated model says that the tip misses, at the nominal set-point and at the corrected one. */
typedef struct {
    double before_m, after_m;
    double before_rad, after_rad; /* NAN where no orientation was asked for */
} armcal_reached;

const char *armcal_version(void);

/* What went wrong in the last call of this thread that failed; valid until its next one that fails. */
const char *armcal_error(void);

/* Reads the text of a model.json, `length` bytes. A fraction of a millisecond; the text is not needed afterwards. */
int32_t armcal_arm_load(const char *json, size_t length, armcal_arm **arm);
/* May be called before its motions are freed. NULL does nothing. */
void armcal_arm_free(armcal_arm *arm);
size_t armcal_arm_joints(const armcal_arm *arm);
/* Whether a joint slides: [m] in the place of [rad]. */
int32_t armcal_arm_slides(const armcal_arm *arm, size_t joint);
/* The name of that kind and number, from 0; NULL behind the last. Valid as long as the arm is. */
const char *armcal_arm_name(const armcal_arm *arm, uint32_t kind, size_t index);

/* The arm under conditions. From where its joints come is not known before armcal_motion_start or armcal_motion_go. */
int32_t armcal_motion_new(const armcal_arm *arm, const armcal_conditions *conditions, armcal_motion **motion);
void armcal_motion_free(armcal_motion *motion);
/* The arm waits at these joints; from where it came is not known. NULL: nor is where it waits. */
int32_t armcal_motion_start(armcal_motion *motion, const double *joint);
/* The arm goes to these joints, each one way. What gaps remember of its moves is carried along. */
int32_t armcal_motion_go(armcal_motion *motion, const double *joint);

/* The tip of the calibrated arm, effects included, were it to go to these joints from where it stands. It stays there.
 * direction: of travel of each joint, +1 or -1, as if it had come from far away; 0: from where it stands. NULL: all 0.
 * velocity:  of each joint [rad/s]; NULL: at rest. Matters to clock_offset.
 * effort:    of each joint [N m], NAN of one without; NULL: not known. Matters to effort_compliance. */
int32_t armcal_motion_tip(const armcal_motion *motion, const double *joint, const double *direction, const double *velocity,
                          const double *effort, armcal_pose *tip);
/* The tip as a controller that knows nothing of the calibration has it. */
int32_t armcal_motion_nominal_tip(const armcal_motion *motion, const double *joint, armcal_pose *tip);

/* The set-point that brings the tip to where the nominal arm has it at these joints, of arms with six joints or more with its
 * orientation; the arm then stands there. time_s: of a point of a path; NAN for a stop.
 * corrected, direction (of arrival: +1, -1, 0 not known), reached: NULL where not wanted. */
int32_t armcal_motion_correct(armcal_motion *motion, const double *nominal, double time_s, double *corrected,
                              double *direction, armcal_reached *reached);
/* The set-point for a place of the tip, which is what `armcal compensate` writes for one target after the other (on a path with
 * --crossing 0); the arm then stands there. quaternion_xyzw: NULL, or of arms with six joints or more. */
int32_t armcal_motion_set_point(armcal_motion *motion, const double position_m[3], const double *quaternion_xyzw,
                                double time_s, double *nominal, double *corrected, double *direction,
                                armcal_reached *reached);
/* The set-points of a path of so many points, from where the arm stands: armcal_motion_correct for one after the other, but a
 * joint that turns back crosses its gap in crossing_s [s] around that moment (0: in one leap), as with `armcal compensate
 * --crossing`; its link waits meanwhile. The arm then stands at the end; on an error, where it stood.
 * nominal, corrected, direction: a number a joint for each point, point after point; time_s: of each, rising.
 * in_gap: a byte a joint for each point, 1 on the way through the gap. reached: one for each point. All outputs may be NULL. */
int32_t armcal_motion_path(armcal_motion *motion, const double *nominal, const double *time_s, size_t points,
                           double crossing_s, double *corrected, double *direction, uint8_t *in_gap,
                           armcal_reached *reached);
/* What is to be known of the last set-point, a line each, after a path with the number of the point (from 0) in front; "" where it is nothing. Valid until the next one. */
const char *armcal_motion_warnings(const armcal_motion *motion);

#ifdef __cplusplus
}
#endif
#endif
