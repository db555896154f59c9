!! Which integrator is to be used and how: what &motion says about it, checked against what a machine's laws allow.
!!
!! The treatment says what is done about the jumps and kinks of contact laws (source thesis, 3.3): `event` finds each change of
!! branch and starts anew there; `switching` looks in every right-hand side which branch holds; `smoothing` replaces jumps by
!! arctangents. `exact` and `moreau_jean` have none: the first knows events only, the second none at all.
module razy_motion_method
   use razy_core_kinds, only: i8, wp
   use razy_machine_machine, only: machine_t
   implicit none(type, external)
   private

   public :: check_method, integrators, method_t, treatments

   character(*), parameter :: integrators(*) = [character(16) :: "automatic", "exact", "rk4", "bogacki_shampine", &
                                                                                "dormand_prince", "dop853", "radau5", "moreau_jean"]
   character(*), parameter :: treatments(*) = [character(16) :: "automatic", "event", "switching", "smoothing"]

   !> A method with its settings.
   type :: method_t
      character(16) :: integrator = "automatic", treatment = "automatic"
      !> Whether `exact` was chosen automatically.
      logical :: automatic = .false.
      !> Tolerances of the error of a step: |error_i| <= absolute + relative |z_i|, z in mass-normalised coordinates.
      real(wp) :: relative_tolerance = 1.0e-9_wp, absolute_tolerance = 1.0e-12_wp
      !> Step of a method without step control; first step of the others, 0: chosen; s.
      real(wp) :: step = 0.0_wp
      !> Sharpness of smoothed jumps (per unit of the contact variable), half width of the band of sticking (m/s, rad/s).
      real(wp) :: sharpness = 1.0e6_wp, band = 1.0e-6_wp
      !> Steps, and time on the clock (s), after which a motion is given up.
      integer(i8) :: most_steps = 1000000000_i8
      real(wp) :: most_seconds = 3600.0_wp
      !> Memory for closed forms (exact), 2^20 bytes.
      integer :: memory_mb = 256
   contains
      procedure :: worst_balance
      procedure :: gives_tangents
   end type method_t

contains

   !> How much of the size of their terms balances of a motion by this method may miss: more than rounding of the closed form, or a
   !> thousand times the tolerance of steps with events; anything without step control or events.
   pure real(wp) function worst_balance(self)
      class(method_t), intent(in) :: self

      worst_balance = merge(1.0e-8_wp, 1.0e3_wp*max(self%relative_tolerance, self%absolute_tolerance), self%integrator == "exact")
      if (self%treatment /= "event" .or. self%integrator == "rk4") worst_balance = huge(1.0_wp)
   end function worst_balance

   !> Whether derivatives of the state can be carried along: where events are found. The method has been checked.
   pure logical function gives_tangents(self)
      class(method_t), intent(in) :: self

      gives_tangents = self%treatment == "event"
   end function gives_tangents

   !> Settle what was left `automatic`, and refuse what a machine's laws do not allow: `key` of &motion that is wrong (blank if
   !> none is), and what is `allowed` there.
   subroutine check_method(method, machine, key, allowed)
      type(method_t), intent(inout) :: method
      type(machine_t), intent(in) :: machine
      character(:), allocatable, intent(out) :: key, allowed

      character(:), allocatable :: curved, other
      integer :: j
      logical :: linear, smoothable, impacts, round, switched, varied

      linear = .true.
      smoothable = .true.
      impacts = .false.
      switched = .false.
      varied = .false.
      round = .false.
      do j = 1, size(machine%contact)
         associate (law => machine%contact(j)%law)
            round = round .or. allocated(machine%contact(j)%frame)
            if (linear) curved = machine%contact(j)%name
            linear = linear .and. law%piecewise_linear .and. .not. allocated(machine%contact(j)%modulation)
            varied = varied .or. machine%contact(j)%mesh_tone > 0 .or. allocated(machine%contact(j)%modulation) .or. law%remembers
            switched = switched .or. machine%contact(j)%mesh_tone > 0
            smoothable = smoothable .and. law%smoothable
            impacts = impacts .or. law%impacts .or. law%remembers
         end associate
      end do
      key = ""
      allowed = ""
      other = ""
      if (round) other = "there is a &ring or a bearing with clearance: what happens in it is not linear"
      if (abs(machine%acceleration) > 0.0_wp) other = "&rotation has an acceleration_rpm_per_s"
      linear = linear .and. other == "" .and. .not. any(machine%tone%bends())
      if (method%integrator == "exact" .and. any(machine%tone%bends())) other = "a table has interpolation = 'cubic'"
      if (other /= "" .and. any(method%integrator == ["exact      ", "moreau_jean"])) then
         key = "integrator"
         allowed = "a Runge-Kutta method such as 'dop853' where "//other
         return
      end if
      if (method%integrator == "automatic") then
         method%integrator = "dop853"
         method%automatic = linear .and. method%treatment == "automatic"
         if (method%automatic) method%integrator = "exact"
      end if
      select case (method%integrator)
      case ("exact")
         if (.not. linear) then
            key = "integrator"
            allowed = "'exact' needs laws that are linear in every branch, and that of '"//curved//"' is not (a power of the "// &
                      "deformation, or friction that changes with the speed, or a stiffness with harmonics); 'dop853' "// &
                      "with treatment = 'event' will do"
         else if (method%treatment /= "automatic" .and. method%treatment /= "event") then
            key = "treatment"
            allowed = "'exact' finds every event; leave out the treatment, or take a Runge-Kutta method"
         end if
         method%treatment = "event"
      case ("moreau_jean")
         if (method%treatment /= "automatic" .and. method%treatment /= "time stepping") then
            key = "treatment"
            allowed = "'moreau_jean' has none; leave it out"
         else if (varied) then
            key = "integrator"
            allowed = "'exact' or a Runge-Kutta method: a mesh stiffness varies, or a Jenkins element slides"
         else if (machine%impacts_in_turn) then
            key = "integrator"
            allowed = "'exact' or a Runge-Kutta method: impacts = 'in_turn'"
         else if (.not. method%step > 0.0_wp) then
            key = "step"
            allowed = "required by 'moreau_jean': the step in s"
         end if
         method%treatment = "time stepping"
      case default
         if (method%treatment == "automatic") method%treatment = "event"
         if (method%integrator == "rk4" .and. .not. method%step > 0.0_wp) then
            key = "step"
            allowed = "required by 'rk4': the step in s"
         else if (method%treatment == "smoothing" .and. .not. smoothable) then
            key = "treatment"
            allowed = "neither a rigid stop nor damping_acts = 'limited' nor a Jenkins element can be smoothed; 'event' will do"
         else if (method%treatment /= "event" .and. switched) then
            key = "treatment"
            allowed = "'event': a mesh stiffness switches"
         else if (method%treatment == "switching" .and. impacts) then
            key = "treatment"
            allowed = "neither a rigid stop nor a Jenkins element can be switched; 'event' will do"
         end if
      end select
   end subroutine check_method

end module razy_motion_method
