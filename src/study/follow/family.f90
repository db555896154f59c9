!! The machines of an input over its values, with the method of &motion, as razy_orbits wants them.
module razy_study_follow_family
   use razy_core_error, only: error_t, raise
   use razy_core_kinds, only: wp
   use razy_core_number, only: to_text
   use razy_hybrid_flow, only: flow_t
   use razy_input_input, only: input_t
   use razy_machine_excitation, only: acting_tones, period_of_loads
   use razy_machine_machine, only: machine_t
   use razy_motion_method, only: method_t
   use razy_orbits_periodic_period_map, only: family_t
   use razy_scenes_case, only: motion_t, new_observed, read_motion
   use razy_scenes_records, only: record_t
   use razy_scenes_scene, only: scene_t
   use razy_scenes_start, only: set_start
   use razy_study_motion, only: new_integrator
   use razy_study_sweep_axes, only: put_value, varied_t
   implicit none(type, external)
   private

   public :: case_family_t, is_of_machine

   !> The input, and which of its values vary; the machine that was made last.
   type, extends(family_t) :: case_family_t
      type(input_t) :: input
      type(varied_t), allocatable :: varied(:)
      type(machine_t), allocatable :: machine
      type(motion_t) :: motion
      type(record_t), allocatable :: records(:)
      !> Whether masses, springs or dampers vary, so that which coordinates are felt may, too; whether it does.
      logical :: linked = .false., keep_all = .false.
      !> Factor of the tolerances.
      real(wp) :: looser = 1.0_wp
      class(scene_t), allocatable, private :: scene
   contains
      procedure :: make
      procedure :: start
   end type case_family_t

   !> Groups whose values are not the machine's.
   character(*), parameter :: machineless(*) = [character(6) :: "sweep", "tune", "record", "motion", "starts", "follow"]

   !> A value as good as 0; what takes longer than by it never comes back.
   real(wp), parameter :: least = 1.0e-150_wp

contains

   !> Whether the value at a path of the input is the machine's.
   pure logical function is_of_machine(path)
      character(*), intent(in) :: path

      is_of_machine = .not. any(path(:scan(path, "(%") - 1) == machineless)
   end function is_of_machine

   !> Prepare the flow of the machine with these values.
   subroutine make(self, parameter, by, period, error)
      class(case_family_t), intent(inout) :: self
      real(wp), intent(in) :: parameter(:)
      class(flow_t), allocatable, intent(inout), target :: by
      real(wp), intent(out) :: period
      type(error_t), allocatable, intent(out) :: error

      type(machine_t), allocatable :: machine
      type(method_t) :: method
      type(record_t), allocatable :: records(:)
      real(wp) :: beside
      integer :: i

      ! What has an amplitude of 0 has its period, too: that of the machine beside.
      beside = 0.0_wp
      if (.not. all(abs(parameter) > 0.0_wp)) then
         call build(sign(max(abs(parameter), least), parameter))
         if (.not. allocated(error)) beside = period_of_loads(machine)
      end if
      period = 0.0_wp
      call build(parameter)
      ! What &motion says is no value of the machine, and read once.
      if (.not. (allocated(error) .or. self%motion%t_end > 0.0_wp)) call read_motion(self%motion, machine, records, self%input, &
                                                                                     error)
      if (allocated(error)) return
      ! Where there is no machine at these values the one before stays.
      call move_alloc(machine, self%machine)
      call move_alloc(records, self%records)
      if (abs(self%machine%acceleration) > 0.0_wp) then
         call self%input%complain(error, "rotation", 1, "acceleration_rpm_per_s", "0 for periodic motions")
         return
      end if
      if (any([(self%machine%contact(i)%law%remembers, i=1, size(self%machine%contact))])) then
         call raise(error, "a Jenkins element remembers where it slid to, which no period map knows: take razy-sweep")
         return
      end if
      method = self%motion%method
      method%relative_tolerance = self%looser*method%relative_tolerance
      method%absolute_tolerance = self%looser*method%absolute_tolerance
      call new_integrator(by, method, error)
      if (allocated(error)) return
      by%system%linked = self%linked
      call by%prepare(self%machine, self%keep_all, error)
      if (allocated(error)) return
      if (by%finds_events) then
         period = max(beside, period_of_loads(self%machine))
         if (period > 1.0_wp/least) call raise(error, "a frequency of 0 has no period")
         if (period > 0.0_wp) return
         if (any(acting_tones(self%machine))) then
            if (any(acting_tones(self%machine) .and. .not. self%machine%tone%hertz > 0.0_wp)) then
               call raise(error, "what acts once has no period: give its shape a frequency, or its file beyond='periodic'")
               return
            end if
            call raise(error, "the tones "//tones()//" have no common period: periodic motions need frequencies in whole ratios")
         end if
         return
      end if
      call raise(error, "the method has no derivatives: &motion integrator='exact', or a Runge-Kutta method with treatment='event'")

   contains

      subroutine build(values)
         real(wp), intent(in) :: values(:)

         do i = 1, size(values)
            call put_value(self%varied(i), self%input, values(i), error)
            if (allocated(error)) return
         end do
         if (allocated(machine)) deallocate (machine)
         allocate (machine)
         call new_observed(machine, records, self%input, error, self%scene)
      end subroutine build

      pure function tones() result(list)
         character(:), allocatable :: list
         integer :: t

         list = ""
         do t = 1, size(self%machine%tone)
            list = list//", "//to_text(real(self%machine%tone(t)%hertz, wp))//" Hz"
         end do
         list = list(3:)
      end function tones

   end subroutine make

   subroutine start(self, displacement, velocity, error)
      class(case_family_t), intent(inout) :: self
      real(wp), allocatable, intent(out) :: displacement(:), velocity(:)
      type(error_t), allocatable, intent(out) :: error

      call set_start(self%machine, self%scene, self%input, error)
      displacement = self%machine%displacement
      velocity = self%machine%velocity
   end subroutine start

end module razy_study_follow_family
