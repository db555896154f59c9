!! Processor time of one motion alone, without start, machine and result file: the least of several runs.
!!
!! Usage: motion INPUT REPEATS INTERVAL [GROUP%KEY=VALUE...]. Seen by the list of events, and by the trajectory of the first observable
!! at times INTERVAL s apart. Standard output: `EVENTS SECONDS`.
program motion
   use razy_core_error, only: error_t
   use razy_core_kinds, only: wp
   use razy_core_text, only: string_t
   use razy_core_text_file, only: read_text_file
   use razy_hybrid_flow, only: flow_t
   use razy_input_input, only: input_t
   use razy_machine_machine, only: machine_t
   use razy_motion_integrator, only: observer_slot_t, outcome_t, status_ok
   use razy_observe_event_log, only: event_log_t
   use razy_observe_trajectory, only: trajectory_t
   use razy_scenes_case, only: motion_t, new_machine, read_study
   use razy_scenes_records, only: record_t
   use razy_study_motion, only: run_motion
   implicit none(type, external)

   class(flow_t), allocatable, target :: integrator
   type(event_log_t), target :: events
   type(trajectory_t), target :: trajectory
   type(error_t), allocatable :: error
   type(input_t) :: input
   type(machine_t) :: machine
   type(motion_t) :: case
   type(observer_slot_t) :: observers(2)
   type(outcome_t) :: outcome
   type(record_t), allocatable :: records(:)
   type(string_t), allocatable :: overrides(:)
   character(:), allocatable :: text
   character(256) :: word(3)
   real(wp) :: finish, least, start
   integer :: i, repeats

   do i = 1, 3
      call get_command_argument(i, word(i))
   end do
   read (word(2), *) repeats
   read (word(3), *) trajectory%interval
   allocate (overrides(command_argument_count() - 3))
   do i = 1, size(overrides)
      call get_command_argument(i + 3, word(3))
      overrides(i)%text = trim(word(3))
   end do
   call read_text_file(trim(word(1)), text, error)
   if (.not. allocated(error)) call read_study(input, text, trim(word(1)), overrides, error)
   if (.not. allocated(error)) call new_machine(machine, case, records, input, error)
   if (allocated(error)) error stop error%message
   trajectory%form = [1]
   observers(1)%observer => events
   observers(2)%observer => trajectory
   least = huge(least)
   do i = 1, repeats
      call events%forget()
      call trajectory%forget()
      call cpu_time(start)
      call run_motion(machine, case%method, case%t_end, observers, outcome, error, integrator=integrator)
      call cpu_time(finish)
      if (allocated(error)) error stop error%message
      if (outcome%status /= status_ok) error stop "the motion did not come to its end"
      least = min(least, finish - start)
   end do
   print "(i0, 1x, es10.3)", outcome%events, least
end program motion
