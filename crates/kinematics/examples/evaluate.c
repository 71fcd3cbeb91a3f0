/* Evaluates a model.json: one question a line on standard input, one answer a line on standard output.
 *
 *   cc evaluate.c -larmcal_kinematics -o evaluate
 *   ./evaluate out/model.json base < questions.txt
 *
 *   start Q..      go Q..        the arm waits there, goes there
 *   tip Q..        nominal Q..   position and quaternion of the calibrated tip, of the nominal one
 *   rising Q..                   of the calibrated one, every joint coming from below
 *   correct Q..                  set-point, directions of arrival, errors before and after
 *   place X Y Z [QX QY QZ QW]    nominal joints, set-point, directions, errors
 *   path S T Q.. T Q.. ..        of each point set-point, directions, in the gap or not, errors; gaps are crossed in S seconds
 */
#include "armcal_kinematics.h"

#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#define MOST 64

static char *whole_file(const char *path, size_t *length)
{
    FILE *file = fopen(path, "rb");
    char *text = NULL;
    if (file && !fseek(file, 0, SEEK_END)) {
        long size = ftell(file);
        rewind(file);
        text = size >= 0 ? malloc((size_t)size + 1) : NULL;
        *length = text ? fread(text, 1, (size_t)size, file) : 0;
    }
    if (file)
        fclose(file);
    return text;
}

static void print(const double *numbers, size_t count)
{
    for (size_t k = 0; k < count; k++)
        printf("%.17g ", numbers[k]);
}

static int32_t path(armcal_motion *motion, size_t joints, const double *given, size_t count)
{
    double nominal[MOST], times[MOST], corrected[MOST], direction[MOST];
    uint8_t in_gap[MOST];
    armcal_reached reached[MOST];
    size_t points = (count - 1) / (joints + 1);
    for (size_t k = 0; k < points; k++) {
        times[k] = given[1 + k * (joints + 1)];
        memcpy(nominal + k * joints, given + 2 + k * (joints + 1), joints * sizeof *nominal);
    }
    int32_t code = armcal_motion_path(motion, nominal, times, points, given[0], corrected, direction, in_gap, reached);
    for (size_t k = 0; code == ARMCAL_OK && k < points; k++) {
        print(corrected + k * joints, joints);
        print(direction + k * joints, joints);
        for (size_t j = 0; j < joints; j++)
            printf("%d ", in_gap[k * joints + j]);
        print(&reached[k].before_m, 4);
    }
    printf("\n");
    return code;
}

static int32_t answer(armcal_motion *motion, size_t joints, const char *word, const double *given, size_t count)
{
    armcal_pose pose;
    armcal_reached reached;
    double nominal[MOST], corrected[MOST], direction[MOST], rising[MOST];
    int32_t code = ARMCAL_ARGUMENT;
    for (size_t k = 0; k < joints; k++)
        rising[k] = 1.0;
    if (!strcmp(word, "path") && count > 1 + joints)
        return path(motion, joints, given, count);
    if (!strcmp(word, "place")) {
        code = armcal_motion_set_point(motion, given, count == 7 ? given + 3 : NULL, NAN, nominal, corrected, direction,
                                       &reached);
        if (code == ARMCAL_OK)
            print(nominal, joints);
    } else if (count != joints) {
        fprintf(stderr, "%s: %zu numbers for %zu joints\n", word, count, joints);
        return code;
    } else if (!strcmp(word, "correct")) {
        code = armcal_motion_correct(motion, given, NAN, corrected, direction, &reached);
    } else if (!strcmp(word, "start")) {
        code = armcal_motion_start(motion, given);
    } else if (!strcmp(word, "go")) {
        code = armcal_motion_go(motion, given);
    } else if (!strcmp(word, "nominal")) {
        code = armcal_motion_nominal_tip(motion, given, &pose);
    } else {
        code = armcal_motion_tip(motion, given, strcmp(word, "rising") ? NULL : rising, NULL, NULL, &pose);
    }
    if (code == ARMCAL_OK && (!strcmp(word, "place") || !strcmp(word, "correct"))) {
        print(corrected, joints);
        print(direction, joints);
        print(&reached.before_m, 4);
    } else if (code == ARMCAL_OK && strcmp(word, "start") && strcmp(word, "go")) {
        print(pose.position_m, 3);
        print(pose.quaternion_xyzw, 4);
    }
    printf("\n");
    return code;
}

int main(int argc, char **argv)
{
    size_t length = 0;
    char *json = argc > 1 ? whole_file(argv[1], &length) : NULL;
    armcal_conditions conditions = {0, argc > 2 && !strcmp(argv[2], "base"), -1, NAN, NAN};
    armcal_arm *arm = NULL;
    armcal_motion *motion = NULL;
    int32_t code = armcal_arm_load(json, length, &arm);
    free(json);
    if (code == ARMCAL_OK)
        code = armcal_motion_new(arm, &conditions, &motion);
    size_t joints = armcal_arm_joints(arm);
    /* The motion keeps what it needs. */
    armcal_arm_free(arm);

    char line[4096];
    while (code == ARMCAL_OK && joints <= MOST && fgets(line, sizeof line, stdin)) {
        double given[MOST];
        size_t count = 0;
        const char *word = strtok(line, " \n");
        for (const char *next; word && count < MOST && (next = strtok(NULL, " \n"));)
            given[count++] = strtod(next, NULL);
        if (word)
            code = answer(motion, joints, word, given, count);
    }
    if (code != ARMCAL_OK)
        fprintf(stderr, "error %d: %s\n", (int)code, armcal_error());
    armcal_motion_free(motion);
    return code;
}
