!! What razy-modes finds for a rotor: undamped modes at rest, and over the speed the Campbell diagram, critical speeds and the
!! stability limit.
module razy_study_modes_rotor
   use, intrinsic :: ieee_arithmetic, only: ieee_quiet_nan, ieee_value
   use razy_core_error, only: error_t, raise
   use razy_core_kinds, only: pi, wp
   use razy_core_number, only: decimal
   use razy_input_input, only: input_t
   use razy_linalg_dense, only: product_of, rising_order
   use razy_linalg_generalised, only: eigenpairs_t, keep_first, modes_found
   use razy_rotor_free_motions, only: in_coordinates, moves_of, rigid_motions, words_of
   use razy_rotor_whirl_banded, only: banded_whirl_t, new_banded_whirl, serves
   use razy_rotor_whirl_campbell, only: campbell_t, new_campbell
   use razy_rotor_whirl_degenerate, only: separate_degenerate
   use razy_rotor_whirl_family, only: whirl_family_t
   use razy_rotor_whirl_modes, only: rotor_modes => natural_modes, rotor_shares => energy_shares, shaft_shares, strain_shares
   use razy_rotor_whirl_stability, only: limit_failed, limit_found, limit_meanings, limit_t, stability_limit
   use razy_rotor_whirl_unstable, only: unstable_radius
   use razy_rotor_whirl_whirl, only: new_whirl, whirl_problem_t
   use razy_scenes_rotor_scene, only: rotor_scene_t
   use razy_study_modes_result, only: modes_result_t
   implicit none(type, external)
   private

   public :: find_campbell, find_rotor_modes, mesh_names

   !> Relative error of the stability limit, and how much farther out than where eigenvalues are unstable they are followed.
   real(wp), parameter :: limit_tolerance = 1.0e-9_wp, margin = 1.25_wp
   character(*), parameter :: motions(4) = [character(64) :: "axial", "torsion", "bending in xy", "bending in xz"]
   character(*), parameter :: strained(3) = [character(64) :: "shafts", "bearings", "meshes"]

contains

   !> Undamped modes at rest.
   subroutine find_rotor_modes(content, rotor, input, count, closed, error)
      type(modes_result_t), intent(inout) :: content
      type(rotor_scene_t), intent(in) :: rotor
      type(input_t), intent(in) :: input
      integer, intent(in) :: count
      logical, intent(in) :: closed
      type(error_t), allocatable, intent(out) :: error

      type(eigenpairs_t) :: pairs
      real(wp), allocatable :: motion(:, :), rigid(:, :), untouched(:, :)
      integer, allocatable :: smallest(:)
      integer :: i, m

      associate (model => rotor%model, reduced => rotor%reduced)
         call rigid_motions(model, .false., .false., .false., closed, motion, untouched)
         content%free = words_of(model, closed)
         if (is_smaller(rotor)) then
            call in_coordinates(model, reduced, motion, rigid)
            motion = rigid
            pairs = reduced%modes(closed)
            if (pairs%status == modes_found) then
               call keep_first(pairs, min(count, size(pairs%value)))
               pairs%vector = product_of(reduced%basis, pairs%vector)
            end if
         else
            pairs = rotor_modes(model, count, closed)
         end if
         ! A shaft that buckles has a negative eigenvalue, or its stiffness no factor.
         if (pairs%status /= modes_found .or. sum(merge(1, 0, pairs%value < 0.0_wp)) > size(motion, 2)) then
            do i = 1, input%count("section")
               if (abs(input%number("section", i, "torque")) > 0.0_wp) then
                  call input%complain(error, "section", i, "torque", "less: the shaft is near to buckling")
               else if (input%number("section", i, "axial_force") < 0.0_wp) then
                  call input%complain(error, "section", i, "axial_force", "less compression: the shaft buckles")
               end if
               if (allocated(error)) return
            end do
         end if
         if (pairs%status /= modes_found) call raise(error, "the eigenproblem could not be solved")
         if (allocated(error)) return
         m = size(pairs%value)
         ! How many follows from structure; which they are, the values tell: bearings with negative stiffness come before them.
         smallest = rising_order(abs(pairs%value))
         content%rigid = spread(0, 1, m)
         content%rigid(smallest(:min(m, size(motion, 2)))) = 1
         where (content%rigid == 1) pairs%value = 0.0_wp
         call separate_degenerate(pairs, model)
         content%coordinate = [character(64) ::(model%numbering%name(model%rotor, i), i=1, model%numbering%n)]
         content%part = motions
         content%strain_part = strained
         content%natural = sqrt(max(pairs%value, 0.0_wp))/(2*pi)
         content%shape = pairs%vector
         content%mesh = mesh_names(input)
         content%deformation = matmul(transpose(model%mesh_direction), pairs%vector)
         content%shaft = [character(64) :: model%rotor%shaft%name]
         allocate (content%share(4, m), content%strain_share(3, m), content%shaft_share(size(content%shaft), m))
         do i = 1, m
            content%shaft_share(:, i) = shaft_shares(model, pairs%vector(:, i))
            content%share(:, i) = rotor_shares(model, pairs%vector(:, i))
            content%strain_share(:, i) = strain_shares(model, pairs%vector(:, i), closed)
         end do
      end associate
      content%speed = [0.0_wp]
      content%frequency = reshape(content%natural, [m, 1])
   end subroutine find_rotor_modes

   !> Whether the machine has fewer coordinates than the model, by &reduction or because some have no mass.
   pure logical function is_smaller(rotor)
      type(rotor_scene_t), intent(in) :: rotor

      is_smaller = allocated(rotor%reduced%basis)
      if (is_smaller) is_smaller = size(rotor%reduced%basis, 2) < rotor%model%numbering%n
   end function is_smaller

   !> Names of all gear meshes of the input.
   function mesh_names(input) result(names)
      type(input_t), intent(in) :: input
      character(64), allocatable :: names(:)

      integer :: i

      allocate (names(input%count("gear_mesh")))
      do i = 1, size(names)
         names(i) = input%text("gear_mesh", i, "name")
      end do
   end function mesh_names

   !> The problem over the speed with what acts, without the rigid motions that nothing feels: of large unreduced models banded,
   !> with the `least` lowest modes and all with moduli up to `radius`, rad/s, else dense with all.
   subroutine new_problem(problem, rotor, gyroscopic, circulatory, damped, closed, least, radius, error)
      class(whirl_family_t), allocatable, intent(out) :: problem
      type(rotor_scene_t), intent(in) :: rotor
      logical, intent(in) :: gyroscopic, circulatory, damped, closed
      integer, intent(in) :: least
      real(wp), intent(in) :: radius
      type(error_t), allocatable, intent(out) :: error

      type(banded_whirl_t) :: banded
      type(whirl_problem_t) :: dense
      real(wp), allocatable :: motion(:, :), of_stiffness(:, :), still(:, :), untouched(:, :)
      logical :: serving

      call rigid_motions(rotor%model, gyroscopic, circulatory .and. damped, damped, closed, motion, still)
      serving = .not. is_smaller(rotor)
      if (serving) serving = serves(rotor%model, closed, least, radius)
      if (serving) then
         banded = new_banded_whirl(rotor%model, closed, gyroscopic, circulatory, damped, size(motion, 2), &
                                   moves_of(rotor%model, still), error)
         banded%least = max(0, least - banded%untouched)
         banded%reach = radius
         problem = banded
         problem%resting = size(motion, 2) - size(still, 2)
      else
         call in_coordinates(rotor%model, rotor%reduced, motion, of_stiffness)
         call in_coordinates(rotor%model, rotor%reduced, still, untouched)
         dense = new_whirl(rotor%reduced, closed, of_stiffness, untouched)
         if (.not. gyroscopic) dense%modal%gyroscopic = 0.0_wp
         dense%damped = damped
         dense%circulatory = circulatory .and. damped
         problem = dense
         problem%resting = size(of_stiffness, 2) - size(untouched, 2)
      end if
   end subroutine new_problem

   !> Eigenvalues over the speed, critical speeds, stability limit.
   subroutine find_campbell(content, rotor, input, count, closed, error)
      type(modes_result_t), intent(inout) :: content
      type(rotor_scene_t), intent(in) :: rotor
      type(input_t), intent(in) :: input
      integer, intent(in) :: count
      logical, intent(in) :: closed
      type(error_t), allocatable, intent(out) :: error

      class(whirl_family_t), allocatable :: problem
      type(campbell_t) :: diagram
      type(limit_t) :: limit
      real(wp), allocatable :: order(:)
      real(wp) :: first, last, nan, radius, unstable
      logical :: circulatory, gyroscopic, with_damping
      integer :: i, modes, points

      call input%get("campbell", 1, "first_rpm", first)
      call input%get("campbell", 1, "last_rpm", last)
      call input%get("campbell", 1, "points", points)
      call input%get("campbell", 1, "orders", order)
      call input%get("campbell", 1, "damped", with_damping)
      call input%get("rotation", 1, "gyroscopic", gyroscopic)
      call input%get("rotation", 1, "circulatory", circulatory)
      content%speed = [((first + (last - first)*(real(i, wp)/(points - 1)))*pi/30, i=0, points - 1)]
      unstable = unstable_radius(rotor%model, content%speed, circulatory)
      if (unstable < huge(unstable)) unstable = margin*unstable
      ! Motions that resonate are damped by less than 1/sqrt(2), so that |lambda| is at most sqrt(2) times the frequency.
      radius = sqrt(2.0_wp)*maxval(order)*maxval(content%speed)
      if (with_damping .and. unstable < huge(unstable)) radius = max(radius, unstable)
      modes = min(count, size(rotor%reduced%load))
      do
         call new_problem(problem, rotor, gyroscopic, circulatory, with_damping, closed, count, radius, error)
         if (.not. allocated(error)) call new_campbell(diagram, problem, rotor%model, content%speed, modes, order, error)
         if (.not. allocated(error) .or. problem%reach >= huge(radius)) exit
         ! Hundreds of overdamped motions accumulate at one place within the radius: all are found, dense.
         deallocate (error)
         radius = huge(radius)
      end do
      if (allocated(error)) return
      content%frequency = aimag(diagram%value)/(2*pi)
      content%eigenvalue = diagram%value
      content%branch = real(diagram%branch, wp)
      content%direction = diagram%direction
      if (with_damping) content%verdict = diagram%verdict
      ! Modes that a speed does not have.
      nan = ieee_value(nan, ieee_quiet_nan)
      where (diagram%branch == 0) content%frequency = nan
      where (diagram%branch == 0) content%branch = nan
      where (diagram%branch == 0) content%direction = nan
      where (diagram%branch == 0) content%eigenvalue = cmplx(nan, nan, wp)
      content%critical = diagram%critical
      content%lost = diagram%lost
      content%limit_check = "nothing can drive whirl: no cross coupling, no circulation"
      if (unstable > 0.0_wp) then
         if (with_damping .and. problem%reach >= unstable) then
            limit = stability_limit(problem, content%speed, limit_tolerance, diagram%worst)
         else
            do
               call new_problem(problem, rotor, gyroscopic, circulatory, .true., closed, 0, unstable, error)
               if (allocated(error)) return
               limit = stability_limit(problem, content%speed, limit_tolerance)
               if (limit%status /= limit_failed .or. problem%reach >= huge(unstable)) exit
               unstable = huge(unstable)
            end do
         end if
         content%limit_check = "all eigenvalues"
         if (problem%reach < huge(unstable)) then
            content%limit_check = content%limit_check//" with moduli up to "//decimal(problem%reach, 3)// &
                                  " rad/s, beyond which none can be unstable"
         end if
      end if
      content%limit = merge(limit%speed, nan, limit%status == limit_found)
      content%limit_frequency = merge(limit%frequency/(2*pi), nan, limit%status == limit_found .or. limit%again < huge(nan))
      content%undecided = merge(limit%undecided, nan, limit%undecided < huge(nan))
      content%limit_words = trim(limit_meanings(limit%status))
      content%limit_then = ""
      if (limit%calm < huge(nan)) content%limit_then = ", no more at "//decimal(limit%calm*30/pi, 2)//" rpm"
      if (limit%again < huge(nan)) content%limit_then = content%limit_then//", again above "//decimal(limit%again, 3)// &
                                                        " rad/s = "//decimal(limit%again*30/pi, 2)//" rpm, "// &
                                                        decimal(limit%frequency/(2*pi), 3)//" Hz"
   end subroutine find_campbell

end module razy_study_modes_rotor
